#include "relight/gather/object_window.h"

#include <algorithm>
#include <cmath>

#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

float angle(const Vector3f& a, const Vector3f& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace

PixelWindow window_of(const std::vector<Eigen::Vector4f>& spheres, const CameraRays& eye) {
  const capture::CameraModel& camera = eye.camera.model;
  const Vector3f eye_m = eye.camera.T_tag_camera.translation();
  const auto may_see = [&](int left, int top, int right, int bottom) {
    const Vector3f middle = eye.ray((left + right) / 2, (top + bottom) / 2);
    float reach = 0;
    for (const auto& [u, v] : {std::pair(left, top), {right, top}, {left, bottom}, {right, bottom}}) {
      const Vector3f corner = eye.ray(u, v, {u == left ? 0.0f : 1.0f, v == top ? 0.0f : 1.0f});
      if (corner.isZero(0) || middle.isZero(0)) return true;  // pixels between them may have rays
      reach = std::max(reach, angle(middle, corner));
    }
    return std::any_of(spheres.begin(), spheres.end(), [&](const Eigen::Vector4f& sphere) {
      const Vector3f to = sphere.head<3>() - eye_m;
      const float far = to.norm();
      return far <= sphere.w() || angle(middle, to) <= std::asin(sphere.w() / far) + reach + kGather.window_margin_rad;
    });
  };
  int left = camera.width, top = camera.height, right = 0, bottom = 0;
  for (int v = 0; v < camera.height; v += kGather.window_px) {
    for (int u = 0; u < camera.width; u += kGather.window_px) {
      const int end_u = std::min(u + kGather.window_px, camera.width),
                end_v = std::min(v + kGather.window_px, camera.height);
      if (!may_see(u, v, end_u - 1, end_v - 1)) continue;
      left = std::min(left, u);
      top = std::min(top, v);
      right = std::max(right, end_u);
      bottom = std::max(bottom, end_v);
    }
  }
  if (left >= right) return {};
  return {left, top, right - left, bottom - top};
}

}  // namespace lumigraft::relight
