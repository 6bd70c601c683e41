#include "reconstruct/pose/tag_map.h"

#include <cmath>

#include "capture/message_text.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Step = Eigen::Matrix<double, 6, 1>;

/// Whether a difference is larger than allowed.
bool contradicts(const Step& step, const Step& sigma) {
  return step.head<3>().norm() > kTagMap.moved_m + kTagMap.moved_sigmas * sigma.head<3>().norm() ||
         step.tail<3>().norm() > kTagMap.moved_rad + kTagMap.moved_sigmas * sigma.tail<3>().norm();
}

}  // namespace

PoseCovariance TagMapEntry::uncertainty(const Isometry3d& T_camera_tag) const {
  PoseCovariance of_tag = PoseCovariance::Zero();  // rotation, translation
  if (first_) return of_tag;
  double position_sigma_m = kTagMap.configured_sigma_m, angle_sigma_rad = kTagMap.configured_sigma_rad;
  if (count_ >= kTagMap.min_sightings) {
    const Step variance = squares_ / (count_ - 1.0) / count_;
    position_sigma_m = std::sqrt(kTagMap.min_sigma_m * kTagMap.min_sigma_m + variance.head<3>().sum() / 3);
    angle_sigma_rad = std::sqrt(kTagMap.min_sigma_rad * kTagMap.min_sigma_rad + variance.tail<3>().sum() / 3);
  }
  of_tag.diagonal().head<3>().setConstant(angle_sigma_rad * angle_sigma_rad);
  of_tag.diagonal().tail<3>().setConstant(position_sigma_m * position_sigma_m);
  return camera_covariance(of_tag, T_camera_tag);
}

void TagMapEntry::add_sighting(const Isometry3d& T_world_tag) {
  if (first_) return;
  if (count_ > 0) {
    const Step difference = step_between(mean_, T_world_tag);
    const Step sigma = count_ >= kTagMap.min_sightings ? Step((squares_ / (count_ - 1.0)).cwiseSqrt())
                                                       : Step(Step::Constant(kTagMap.moved_m));
    contradicting_ = contradicts(difference, sigma) ? contradicting_ + 1 : 0;
    if (contradicting_ > 0 && contradicting_ < kTagMap.moved_sightings) return;
  }
  if (count_ == 0 || contradicting_ >= kTagMap.moved_sightings) {
    if (count_ >= kTagMap.min_sightings) T_world_tag_.reset();  // it was moved
    mean_ = T_world_tag;
    squares_.setZero();
    count_ = 1;
    contradicting_ = 0;
    return;
  }
  // Welford's running mean and sum of squares with a limited count.
  if (count_ == kTagMap.max_sightings) {
    squares_ *= (kTagMap.max_sightings - 1.0) / kTagMap.max_sightings;
    --count_;
  }
  ++count_;
  const Step before = step_between(mean_, T_world_tag);
  mean_ = apply_step(mean_, before / count_);
  squares_ += before.cwiseProduct(step_between(mean_, T_world_tag));
  if (count_ >= kTagMap.min_sightings) T_world_tag_ = mean_;
}

std::string TagMapEntry::warning(int id) const {
  if (!T_world_tag_) return capture::formatted("tag %d: not used until it is seen together with others", id);
  if (!configured_ || count_ < kTagMap.min_sightings) return {};
  const Step difference = step_between(*configured_, mean_);
  if (!contradicts(difference, (squares_ / (count_ - 1.0) / count_).cwiseSqrt())) return {};
  return capture::formatted("tag %d: is %.0f mm and %.1f degrees from its configured pose", id,
                            1e3 * difference.head<3>().norm(), difference.tail<3>().norm() * 180 / M_PI);
}

}  // namespace lumigraft::reconstruct
