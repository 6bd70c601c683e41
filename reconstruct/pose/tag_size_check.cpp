#include "reconstruct/pose/tag_size_check.h"

#include <algorithm>
#include <cmath>

#include "capture/message_text.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
void TagSizeCheck::add(const DepthPlane& plane, const Eigen::Isometry3d& T_camera_tag) {
  const Eigen::Vector3d centre = T_camera_tag.translation();
  const double inverse_depth = plane.inverse_depth.dot(centre / centre.z());
  if (!(inverse_depth > 0) || !(centre.z() > 0)) return;
  count_ = std::min(count_ + 1, kTagSize.max_frames);
  mean_ += (-std::log(inverse_depth * centre.z()) - mean_) / count_;
  distance_m_ += (centre.z() - distance_m_) / count_;
}

std::string TagSizeCheck::warning() const {
  const double ratio = std::exp(mean_);
  const double tolerance = kTagSize.tolerance + kTagSize.tolerance_per_m * std::max(0.0, distance_m_ - 1);
  if (count_ < kTagSize.min_frames || std::abs(mean_) < tolerance) return {};
  if (ratio > kTagSize.unit_factor || ratio < 1 / kTagSize.unit_factor)
    return capture::formatted(
        "depth: %.3g times the distance of tag %d by its size: depth.unit_m or tag.size_m is in another unit", ratio,
        id_);
  return capture::formatted("tag %d: by depth its square is %.0f mm wide, configured are %.0f mm", id_,
                            1e3 * size_m_ * ratio, 1e3 * size_m_);
}

}  // namespace lumigraft::reconstruct
