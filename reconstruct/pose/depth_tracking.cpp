#include "reconstruct/pose/depth_tracking.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;

constexpr double kFadeS = 0.15;       // time constant of the hand-back: a few frames
constexpr double kLongestGapS = 0.5;  // beyond it the pose is anywhere
constexpr double kAnywhere = 100;     // of the variance: what the picture before shows counts more than a guess
constexpr double kLeap = 6;           // σ
constexpr double kLargestFadeM = 0.05, kLargestFadeRad = 0.07;  // a tag farther off is believed at once
constexpr double kHeldM = 0.03, kHeldRad = 0.035;               // 1σ beyond which surfaces do not hold the pose

bool within(const Isometry3d& T, double position_m, double angle_rad) {
  return T.translation().norm() <= position_m && Eigen::AngleAxisd(T.linear()).angle() <= angle_rad;
}

/// The share of a small transform that is left.
Isometry3d faded(const Isometry3d& T, double share) {
  return apply_step(Isometry3d::Identity(), share * step_between(Isometry3d::Identity(), T));
}

}  // namespace

PoseCovariance DepthTracking::after(const PoseCovariance& covariance, double passed_s) {
  // A hand that holds a camera: 5 mm and half a degree from frame to frame, and 3 m/s² and 10 rad/s² of what changes.
  const double position_m = std::min(0.3, 0.005 + 0.5 * 3 * passed_s * passed_s);
  const double angle_rad = std::min(0.3, 0.01 + 0.5 * 10 * passed_s * passed_s);
  PoseCovariance result = covariance;
  result.diagonal().head<3>().array() += position_m * position_m;
  result.diagonal().tail<3>().array() += angle_rad * angle_rad;
  return result;
}

void DepthTracking::reset() {
  last_.reset();
  depth_.reset();
  grid_.reset();
  speed_.setZero();
  carrying_ = false;
  fading_.setIdentity();
}

void DepthTracking::keep(const capture::FrameSet& frame, const PoseEstimate& pose) {
  const double passed = passed_s(frame);
  if (last_ && passed > 0 && passed < kLongestGapS)
    speed_ = step_between(last_->T_tag_camera, pose.T_tag_camera) / passed;
  else
    speed_.setZero();
  last_ = pose;
  time_ns_ = frame.time_ns;
  depth_ = frame.depth;
  grid_.reset();
}

/// Where surfaces put the camera now. Keeps it.
std::optional<PoseEstimate> DepthTracking::follow(const capture::FrameSet& frame, const DistanceField& field) {
  const double passed = passed_s(frame);
  if (!frame.depth || !(passed > 0) || passed > kLongestGapS) return std::nullopt;
  DepthGrid grid = sampler_.sample(frame.depth->depth_m);
  PoseEstimate expected{apply_step(last_->T_tag_camera, passed * speed_), after(last_->covariance, passed)};
  const Isometry3d guess = expected.T_tag_camera;
  if (!grid_ && depth_) grid_ = sampler_.sample(depth_->depth_m);
  if (grid_ && !grid_->points.empty() && !grid.points.empty())
    expected.T_tag_camera = align_to_picture(grid, *grid_, sampler_.camera(), last_->T_tag_camera,
                                             {expected.T_tag_camera, kAnywhere * expected.covariance});
  auto fit = align_to_field(grid, field, expected);
  if (!fit) return std::nullopt;
  // After a leap that no hand makes, surfaces may have been taken for one another: the pose is as unsure as it was
  // long.
  const auto leap = step_between(guess, fit->pose.T_tag_camera);
  if (leap.head<3>().norm() > kLeap * position_sigma_m(expected.covariance) ||
      leap.tail<3>().norm() > kLeap * angle_sigma_rad(expected.covariance))
    fit->pose.covariance += 0.1 * leap * leap.transpose();
  if (position_sigma_m(fit->pose.covariance) > kHeldM || angle_sigma_rad(fit->pose.covariance) > kHeldRad)
    return std::nullopt;
  keep(frame, fit->pose);
  grid_ = std::move(grid);
  return fit->pose;
}

std::optional<PoseEstimate> DepthTracking::hidden(const capture::FrameSet& frame, const DistanceField& field) {
  if (!last_) return std::nullopt;
  if (!carrying_) {
    // Depth cameras and prints disagree by a little. Where the surface puts the camera of the last frame that saw both
    // tells by how much; without it the picture would jump.
    if (!depth_) return std::nullopt;
    grid_ = sampler_.sample(depth_->depth_m);
    const auto fit = align_to_field(*grid_, field, {last_->T_tag_camera, after(last_->covariance, 0)});
    if (!fit) return std::nullopt;
    apart_ = fit->pose.T_tag_camera.inverse() * shown_;
    if (!within(apart_, kLargestFadeM, kLargestFadeRad)) return std::nullopt;
    start_ = last_->covariance;
    *last_ = fit->pose;
    carrying_ = true;
  }
  auto pose = follow(frame, field);
  if (!pose) return std::nullopt;
  pose->T_tag_camera = pose->T_tag_camera * apart_;
  return pose;
}

Isometry3d DepthTracking::seen(const capture::FrameSet& frame, const PoseEstimate& measured,
                               const DistanceField* field) {
  const double passed = passed_s(frame);
  if (carrying_) {
    carrying_ = false;
    fading_.setIdentity();
    const auto carried = field ? follow(frame, *field) : std::nullopt;
    if (carried) fading_ = measured.T_tag_camera.inverse() * carried->T_tag_camera * apart_;
    if (!within(fading_, kLargestFadeM, kLargestFadeRad)) fading_.setIdentity();
    const auto speed = speed_;
    keep(frame, measured);
    speed_ = speed;  // the step from surfaces to the tag is none of the camera's
  } else {
    fading_ = last_ && passed > 0 ? faded(fading_, std::exp(-passed / kFadeS)) : Isometry3d::Identity();
    keep(frame, measured);
  }
  return measured.T_tag_camera * fading_;
}

}  // namespace lumigraft::reconstruct
