#include "reconstruct/pose/tag_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Step = Eigen::Matrix<double, 6, 1>;

constexpr int kEnough = 8, kMost = 300, kMoved = 15;           // sightings
constexpr double kConfiguredM = 0.003, kConfiguredRad = 0.01;  // 1σ of what a hand measures
constexpr double kFloorM = 0.0003, kFloorRad = 0.0005;         // 1σ that no number of sightings goes below
constexpr double kElsewhereM = 0.01, kElsewhereRad = 0.035;    // beyond it, and beyond noise, a tag hangs elsewhere

/// How far beyond what is allowed.
bool beyond(const Step& step, const Step& sigma) {
  return step.head<3>().norm() > kElsewhereM + 4 * sigma.head<3>().norm() ||
         step.tail<3>().norm() > kElsewhereRad + 4 * sigma.tail<3>().norm();
}

}  // namespace

PoseCovariance TagMapEntry::slack(const Isometry3d& T_camera_tag) const {
  PoseCovariance of_tag = PoseCovariance::Zero();  // turn, shift
  if (first_) return of_tag;
  double shift_m = kConfiguredM, turn_rad = kConfiguredRad;
  if (count_ >= kEnough) {
    const Step variance = squares_ / (count_ - 1.0) / count_;
    shift_m = std::sqrt(kFloorM * kFloorM + variance.head<3>().sum() / 3);
    turn_rad = std::sqrt(kFloorRad * kFloorRad + variance.tail<3>().sum() / 3);
  }
  of_tag.diagonal().head<3>().setConstant(turn_rad * turn_rad);
  of_tag.diagonal().tail<3>().setConstant(shift_m * shift_m);
  return camera_covariance(of_tag, T_camera_tag);
}

void TagMapEntry::see(const Isometry3d& seen) {
  if (first_) return;
  if (count_ > 0) {
    const Step off = step_between(mean_, seen);
    const Step sigma =
        count_ >= kEnough ? Step((squares_ / (count_ - 1.0)).cwiseSqrt()) : Step(Step::Constant(kElsewhereM));
    elsewhere_ = beyond(off, sigma) ? elsewhere_ + 1 : 0;
    if (elsewhere_ > 0 && elsewhere_ < kMoved) return;
  }
  if (count_ == 0 || elsewhere_ >= kMoved) {
    if (count_ >= kEnough) T_world_tag_.reset();  // it hangs elsewhere now
    mean_ = seen;
    squares_.setZero();
    count_ = 1;
    elsewhere_ = 0;
    return;
  }
  // Welford's running mean and sum of squares; the past counts for kMost at most.
  if (count_ == kMost) {
    squares_ *= (kMost - 1.0) / kMost;
    --count_;
  }
  ++count_;
  const Step before = step_between(mean_, seen);
  mean_ = apply_step(mean_, before / count_);
  squares_ += before.cwiseProduct(step_between(mean_, seen));
  if (count_ >= kEnough) T_world_tag_ = mean_;
}

std::string TagMapEntry::warning(int id) const {
  char text[200];
  if (!T_world_tag_) {
    std::snprintf(text, sizeof(text), "tag %d: not used before it was seen beside others", id);
    return text;
  }
  if (!configured_ || count_ < kEnough) return {};
  const Step off = step_between(*configured_, mean_);
  if (!beyond(off, (squares_ / (count_ - 1.0) / count_).cwiseSqrt())) return {};
  std::snprintf(text, sizeof(text), "tag %d: hangs %.0f mm and %.1f degrees from where it is configured", id,
                1e3 * off.head<3>().norm(), off.tail<3>().norm() * 180 / M_PI);
  return text;
}

}  // namespace lumigraft::reconstruct
