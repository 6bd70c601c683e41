#include "reconstruct/pose/tag_size_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lumigraft::reconstruct {
namespace {

constexpr int kFewest = 5, kMost = 30;  // frames in the mean
// What depth cameras may err by: their own scale, and more where they look far.
constexpr double kTolerance = 0.03, kTolerancePerM = 0.015;
constexpr double kUnitFactor = 3;  // no print is off by so much; units are

}  // namespace

void TagSizeCheck::see(const DepthPlane& plane, const Eigen::Isometry3d& T_camera_tag) {
  const Eigen::Vector3d centre = T_camera_tag.translation();
  const double inverse_depth = plane.inverse_depth.dot(centre / centre.z());
  if (!(inverse_depth > 0) || !(centre.z() > 0)) return;
  count_ = std::min(count_ + 1, kMost);
  mean_ += (-std::log(inverse_depth * centre.z()) - mean_) / count_;
  distance_m_ += (centre.z() - distance_m_) / count_;
}

std::string TagSizeCheck::warning() const {
  const double ratio = std::exp(mean_);
  const double tolerance = kTolerance + kTolerancePerM * std::max(0.0, distance_m_ - 1);
  if (count_ < kFewest || std::abs(mean_) < tolerance) return {};
  char text[200];
  if (ratio > kUnitFactor || ratio < 1 / kUnitFactor)
    std::snprintf(text, sizeof(text),
                  "depth: %.3g times as far as tag %d is by its size: depth.unit_m or tag.size_m is in another unit",
                  ratio, id_);
  else
    std::snprintf(text, sizeof(text), "tag %d: by depth its square is %.0f mm wide, configured are %.0f mm", id_,
                  1e3 * size_m_ * ratio, 1e3 * size_m_);
  return text;
}

}  // namespace lumigraft::reconstruct
