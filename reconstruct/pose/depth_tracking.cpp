#include "reconstruct/pose/depth_tracking.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;

bool within(const Isometry3d& T, double position_m, double angle_rad) {
  return T.translation().norm() <= position_m && Eigen::AngleAxisd(T.linear()).angle() <= angle_rad;
}

/// A fraction of a small transform.
Isometry3d scaled(const Isometry3d& T, double fraction) {
  return apply_step(Isometry3d::Identity(), fraction * step_between(Isometry3d::Identity(), T));
}

}  // namespace

PoseCovariance DepthTracking::predicted(const PoseCovariance& covariance, double elapsed_s) {
  const DepthTrackingParameters& p = kDepthTracking;
  const double position_m = std::min(p.max_step, p.step_m + 0.5 * p.acceleration_mps2 * elapsed_s * elapsed_s);
  const double angle_rad = std::min(p.max_step, p.step_rad + 0.5 * p.acceleration_radps2 * elapsed_s * elapsed_s);
  PoseCovariance result = covariance;
  result.diagonal().head<3>().array() += position_m * position_m;
  result.diagonal().tail<3>().array() += angle_rad * angle_rad;
  return result;
}

PoseCovariance DepthTracking::held(const PoseCovariance& covariance, double elapsed_s) const {
  const Eigen::Matrix<double, 6, 1> step = elapsed_s * velocity_;
  return predicted(covariance, elapsed_s) + step * step.transpose();
}

void DepthTracking::reset() {
  last_.reset();
  depth_.reset();
  grid_.reset();
  velocity_.setZero();
  tracking_ = false;
  fading_.setIdentity();
  settled_.reset();
  next_settled_.reset();
}

/// Copies of a field share its bricks.
void DepthTracking::remember(const capture::FrameSet& frame, const DistanceField& field) {
  if (next_settled_ && frame.time_ns - next_settled_ns_ < kDepthTracking.settled_ns) return;
  settled_ = std::exchange(next_settled_, std::make_shared<const DistanceField>(field));
  next_settled_ns_ = frame.time_ns;
}

void DepthTracking::store(const capture::FrameSet& frame, const PoseEstimate& pose) {
  const double elapsed = elapsed_s(frame);
  if (last_ && elapsed > 0 && elapsed < kDepthTracking.max_gap_s)
    velocity_ = step_between(last_->T_tag_camera, pose.T_tag_camera) / elapsed;
  else
    velocity_.setZero();
  last_ = pose;
  time_ns_ = frame.time_ns;
  depth_ = frame.depth;
  grid_.reset();
}

/// Pose by ICP of this frame's depth against the previous frame, then against the field. Stores it.
std::optional<PoseEstimate> DepthTracking::align(const capture::FrameSet& frame, const DistanceField& field) {
  const double elapsed = elapsed_s(frame);
  if (!frame.depth || !(elapsed > 0) || elapsed > kDepthTracking.max_gap_s) return std::nullopt;
  DepthGrid grid = sampler_.sample(frame.depth->depth_m);
  const PoseEstimate expected{apply_step(last_->T_tag_camera, elapsed * velocity_),
                              predicted(last_->covariance, elapsed)};
  Isometry3d start = expected.T_tag_camera;
  if (!grid_ && depth_) grid_ = sampler_.sample(depth_->depth_m);
  if (grid_ && !grid_->points.empty() && !grid.points.empty())
    start = align_to_frame(grid, *grid_, sampler_.camera(), last_->T_tag_camera,
                           {expected.T_tag_camera, kDepthTracking.frame_prior * expected.covariance});
  auto fit = align_to_field(grid, field, expected, start);
  // What changed since the last frame may be a person who walks before a camera that rests, and who is in the field by
  // now, too.
  const auto unexpected = [&](const Isometry3d& pose) {
    return !within(expected.T_tag_camera.inverse() * pose, kDepthTracking.step_m, kDepthTracking.step_rad);
  };
  if (unexpected(start) || (fit && unexpected(fit->pose.T_tag_camera))) {
    const DistanceField& earlier = settled_ ? *settled_ : field;
    const auto at_expected = align_to_field(grid, earlier, expected);
    const auto cost = [&](const SurfaceFit& of) { return surface_cost(grid, earlier, expected, of.pose.T_tag_camera); };
    if (at_expected && (!fit || cost(*at_expected) < cost(*fit))) fit = at_expected;
  }
  if (!fit) return std::nullopt;
  // A jump that no hand makes may be a match with the wrong surface.
  const auto jump = step_between(expected.T_tag_camera, fit->pose.T_tag_camera);
  if (jump.head<3>().norm() > kDepthTracking.max_jump_sigmas * position_sigma_m(expected.covariance) ||
      jump.tail<3>().norm() > kDepthTracking.max_jump_sigmas * angle_sigma_rad(expected.covariance))
    fit->pose.covariance += kDepthTracking.jump_variance * jump * jump.transpose();
  if (position_sigma_m(fit->pose.covariance) > kDepthTracking.max_sigma_m ||
      angle_sigma_rad(fit->pose.covariance) > kDepthTracking.max_sigma_rad)
    return std::nullopt;
  store(frame, fit->pose);
  grid_ = std::move(grid);
  return fit->pose;
}

std::optional<PoseEstimate> DepthTracking::track(const capture::FrameSet& frame, const DistanceField& field) {
  if (!last_) return std::nullopt;
  remember(frame, field);
  if (!tracking_) {
    // Poses from depth and from the print differ slightly. The last frame that has both gives the difference; without
    // it the image would jump.
    if (!depth_) return std::nullopt;
    grid_ = sampler_.sample(depth_->depth_m);
    const auto fit = align_to_field(*grid_, field, {last_->T_tag_camera, predicted(last_->covariance, 0)});
    if (!fit) return std::nullopt;
    handover_ = fit->pose.T_tag_camera.inverse() * displayed_;
    if (!within(handover_, kDepthTracking.max_fade_m, kDepthTracking.max_fade_rad)) return std::nullopt;
    start_covariance_ = last_->covariance;
    *last_ = fit->pose;
    tracking_ = true;
  }
  auto pose = align(frame, field);
  if (!pose) return std::nullopt;
  pose->T_tag_camera = pose->T_tag_camera * handover_;
  return pose;
}

std::optional<PoseEstimate> DepthTracking::restart(const capture::FrameSet& frame, const PoseEstimate& found,
                                                   const DistanceField* field) {
  PoseEstimate pose = found;
  if (field && frame.depth) {
    const auto fit = align_to_field(sampler_.sample(frame.depth->depth_m), *field, found);
    if (!fit) return std::nullopt;
    pose = fit->pose;
  }
  if (position_sigma_m(pose.covariance) > kDepthTracking.max_sigma_m ||
      angle_sigma_rad(pose.covariance) > kDepthTracking.max_sigma_rad)
    return std::nullopt;
  tracking_ = true;
  handover_.setIdentity();
  fading_.setIdentity();
  start_covariance_.setZero();
  store(frame, pose);
  return pose;
}

Isometry3d DepthTracking::tag_seen(const capture::FrameSet& frame, const PoseEstimate& measured,
                                   const DistanceField* field) {
  const double elapsed = elapsed_s(frame);
  if (field) remember(frame, *field);
  if (tracking_) {
    tracking_ = false;
    fading_.setIdentity();
    const auto tracked = field ? align(frame, *field) : std::nullopt;
    if (tracked) fading_ = measured.T_tag_camera.inverse() * tracked->T_tag_camera * handover_;
    if (!within(fading_, kDepthTracking.max_fade_m, kDepthTracking.max_fade_rad)) fading_.setIdentity();
    const auto velocity = velocity_;
    store(frame, measured);
    velocity_ = velocity;  // the step from depth to tag is no motion of the camera
  } else {
    fading_ =
        last_ && elapsed > 0 ? scaled(fading_, std::exp(-elapsed / kDepthTracking.fade_s)) : Isometry3d::Identity();
    store(frame, measured);
  }
  return measured.T_tag_camera * fading_;
}

}  // namespace lumigraft::reconstruct
