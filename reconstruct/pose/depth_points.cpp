#include "reconstruct/pose/depth_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {

using Eigen::Vector2f;
using Eigen::Vector3f;

DepthSampler::DepthSampler(const capture::CameraModel& camera, const capture::DepthNoise& noise)
    : camera_(camera), noise_(noise) {
  step_ = std::max(1, (camera.width + kDepthPoints.columns / 2) / kDepthPoints.columns);
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

/// What noise makes of the difference between twice the middle of three points on a plane and the sum of the others.
float DepthSampler::rim_m(float z) const { return kDepthPoints.rim_sigmas * noise_.axial_sigma_m(z); }

DepthGrid DepthSampler::sample(const capture::Image<float>& depth_m) const {
  if (depth_m.width != camera_.width || depth_m.height != camera_.height) return {};
  DepthGrid grid{
      .columns = columns_, .rows = rows_, .step = step_, .points = std::vector<DepthGrid::Point>(rays_.size())};
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * columns_ + c;
      const int u = step_ * c + step_ / 2, v = step_ * r + step_ / 2;
      const float centre = depth_m.at(u, v);
      if (!(centre > 0) || centre > kDepthPoints.far_m || !std::isfinite(rays_[i].x())) continue;
      // Mean with the pixels around, in opposite pairs, so that a slope cancels; pairs across a rim do not count.
      if (u < 1 || v < 1 || u + 1 >= depth_m.width || v + 1 >= depth_m.height) continue;
      float sum = centre;
      int count = 1;
      constexpr int kPairs[4][2] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};
      for (const auto& [x, y] : kPairs) {
        const float ahead = depth_m.at(u + x, v + y), behind = depth_m.at(u - x, v - y);
        if (!(ahead > 0) || !(behind > 0) || std::abs(ahead + behind - 2 * centre) > rim_m(centre)) continue;
        if (std::abs(ahead - behind) > kDepthPoints.max_pixel_step * centre) continue;
        sum += ahead + behind;
        count += 2;
      }
      if (count < kDepthPoints.min_pixels) continue;  // a rim, or flying pixels
      const float z = sum / static_cast<float>(count);
      grid.points[i].position = {rays_[i].x() * z, rays_[i].y() * z, z};
      grid.points[i].sigma_m = noise_.axial_sigma_m(z) / std::sqrt(kDepthPoints.independent_pixels);
    }
  for (int r = 1; r + 1 < rows_; ++r)
    for (int c = 1; c + 1 < columns_; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * columns_ + c;
      DepthGrid::Point& point = grid.points[i];
      const Vector3f &left = grid.at(c - 1, r).position, &right = grid.at(c + 1, r).position,
                     &up = grid.at(c, r - 1).position, &down = grid.at(c, r + 1).position;
      const float z = point.position.z();
      if (z == 0) continue;
      // Both halves of each axis must have the same slope: no rim, no crease.
      const auto straight = [&](const Vector3f& a, const Vector3f& b) {
        return a.z() > 0 && b.z() > 0 && std::abs(a.z() + b.z() - 2 * z) < rim_m(z) &&
               std::abs(a.z() - b.z()) < kDepthPoints.max_point_step * z;
      };
      if (!straight(left, right) || !straight(up, down)) continue;
      const Vector3f across = (down - up).cross(right - left);
      if (across.norm() > 0) point.normal = across.normalized();
      if (point.normal.dot(point.position) > 0) point.normal = -point.normal;
    }
  return grid;
}

}  // namespace lumigraft::reconstruct
