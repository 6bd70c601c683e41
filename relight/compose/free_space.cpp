#include "relight/compose/free_space.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace lumigraft::relight {
namespace {

/// The smallest depth around each pixel that has one, up to a voxel away. 0: none at the pixel itself.
capture::Image<float> nearest_around(const capture::Image<float>& z_m, float fx, float voxel_m) {
  float near_m = std::numeric_limits<float>::max();
  capture::Image<float> nearest_m = z_m;
  for (float& z : nearest_m.data) {
    if (!(z > 0)) z = std::numeric_limits<float>::max();
    near_m = std::min(near_m, z);
  }
  const float px = std::clamp(voxel_m * fx / near_m, 1.0f, static_cast<float>(kCompose.moved_max_edge_px));
  const int edge = 2 * static_cast<int>(std::ceil(px)) + 1;
  const cv::Mat1f nearest(nearest_m.height, nearest_m.width, nearest_m.data.data());
  cv::erode(nearest, nearest, cv::getStructuringElement(cv::MORPH_RECT, {edge, edge}));
  for (std::size_t i = 0; i < z_m.data.size(); ++i) {
    if (!(z_m.data[i] > 0)) nearest_m.data[i] = 0;
  }
  return nearest_m;
}

}  // namespace

FreeSpace::FreeSpace(const PosedCamera& camera, const CurrentDepth& depth)
    : camera_(camera),
      T_camera_tag_(camera.T_tag_camera.inverse()),
      around_z_m_(nearest_around(depth.along_z_m(), static_cast<float>(camera.model.fx), depth.voxel_m())) {
  for (float& z : around_z_m_.data) z = z > 0 ? std::max(z - depth.allowed_m(z), 0.0f) : 0;
}

std::optional<FreeSpace::Place> FreeSpace::place(const Eigen::Vector3f& p_m) const {
  const Eigen::Vector3f p = T_camera_tag_ * p_m;
  const auto at = p.z() > 0 ? camera_.model.project(p.cast<double>()) : std::nullopt;
  if (!at || !camera_.model.inside(*at)) return std::nullopt;
  return Place{static_cast<int>(std::lround(at->x())), static_cast<int>(std::lround(at->y())), p.z()};
}

bool FreeSpace::contains(const Eigen::Vector3f& p_m) const {
  const std::optional<Place> at = place(p_m);
  return at && contains(*at);
}

}  // namespace lumigraft::relight
