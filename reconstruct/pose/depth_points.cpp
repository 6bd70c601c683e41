#include "reconstruct/pose/depth_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kColumns = 80;  // points in a row, whatever the picture's width
constexpr float kFarM = 5;

/// Axial noise of a structured-light camera (Nguyen, Izadi & Lovell 2012, eq. 3, its part seen head-on).
float depth_sigma_m(float z) { return 0.0012f + 0.0019f * (z - 0.4f) * (z - 0.4f); }

/// The most by which noise lets the middle of three points on a plane stand off from the two others' mean, twice.
float rim_m(float z) { return 8 * depth_sigma_m(z); }

}  // namespace

DepthSampler::DepthSampler(const capture::CameraModel& camera) : camera_(camera) {
  step_ = std::max(1, (camera.width + kColumns / 2) / kColumns);
  columns_ = camera.width / step_;
  rows_ = camera.height / step_;
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const auto direction =
          camera.unproject({static_cast<double>(step_ * c + step_ / 2), static_cast<double>(step_ * r + step_ / 2)});
      rays_.push_back(direction && direction->z() > 0 ? Vector2f((direction->head<2>() / direction->z()).cast<float>())
                                                      : Vector2f(kNaN, kNaN));
    }
}

DepthGrid DepthSampler::sample(const capture::Image<float>& depth_m) const {
  DepthGrid grid;
  if (depth_m.width != camera_.width || depth_m.height != camera_.height) return grid;
  grid.columns = columns_;
  grid.rows = rows_;
  grid.step = step_;
  grid.points.resize(rays_.size());
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * columns_ + c;
      const int u = step_ * c + step_ / 2, v = step_ * r + step_ / 2;
      const float centre = depth_m.at(u, v);
      if (!(centre > 0) || centre > kFarM || !std::isfinite(rays_[i].x())) continue;
      // The mean with the pixels around it, by opposite pairs: a slant cancels, and a pair over a rim does not count.
      if (u < 1 || v < 1 || u + 1 >= depth_m.width || v + 1 >= depth_m.height) continue;
      float sum = centre;
      int count = 1;
      constexpr int kPairs[4][2] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};
      for (const auto& [x, y] : kPairs) {
        const float ahead = depth_m.at(u + x, v + y), behind = depth_m.at(u - x, v - y);
        if (!(ahead > 0) || !(behind > 0) || std::abs(ahead + behind - 2 * centre) > rim_m(centre)) continue;
        if (std::abs(ahead - behind) > 0.1f * centre) continue;
        sum += ahead + behind;
        count += 2;
      }
      if (count < 7) continue;  // a rim, or flying pixels
      const float z = sum / static_cast<float>(count);
      grid.points[i].place = {rays_[i].x() * z, rays_[i].y() * z, z};
      // Neighbouring pixels err together: nine count for three.
      grid.points[i].sigma_m = depth_sigma_m(z) / std::sqrt(3.0f);
    }
  for (int r = 1; r + 1 < rows_; ++r)
    for (int c = 1; c + 1 < columns_; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * columns_ + c;
      DepthGrid::Point& point = grid.points[i];
      const Vector3f &left = grid.at(c - 1, r).place, &right = grid.at(c + 1, r).place, &up = grid.at(c, r - 1).place,
                     &down = grid.at(c, r + 1).place;
      const float z = point.place.z();
      if (z == 0) continue;
      // Both halves of each axis must slant alike: no rim, no crease.
      const auto straight = [&](const Vector3f& a, const Vector3f& b) {
        return a.z() > 0 && b.z() > 0 && std::abs(a.z() + b.z() - 2 * z) < rim_m(z) &&
               std::abs(a.z() - b.z()) < 0.5f * z;
      };
      if (!straight(left, right) || !straight(up, down)) continue;
      const Vector3f across = (down - up).cross(right - left);
      if (across.norm() > 0) point.normal = across.normalized();
      if (point.normal.dot(point.place) > 0) point.normal = -point.normal;
    }
  return grid;
}

}  // namespace lumigraft::reconstruct
