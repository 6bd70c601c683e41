#include "reconstruct/pose/rest_check.h"

#include "reconstruct/pose/depth_tracking.h"
#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/tag_map.h"

namespace lumigraft::reconstruct {

using Step = Eigen::Matrix<double, 6, 1>;

bool tag_moved_alone(const PoseEstimate& by_tag, const PoseEstimate& by_depth, const Eigen::Isometry3d& earlier,
                     const PoseCovariance& expected) {
  const Step difference = step_between(by_depth.T_tag_camera, by_tag.T_tag_camera);
  // Depth of a bare floor does not determine motion along it: the pose is then as uncertain as the expected one.
  if (squared_mahalanobis(difference, by_depth.covariance) <
      kTagMap.measured_by_depth * squared_mahalanobis(difference, expected))
    return false;
  return !contradicts(step_between(earlier, by_depth.T_tag_camera), Step::Zero()) &&
         contradicts(difference, Step::Zero()) &&
         squared_mahalanobis(difference, by_tag.covariance + by_depth.covariance) >=
             kTagMap.moved_sigmas * kTagMap.moved_sigmas;
}

bool surface_shows_motion(const DepthGrid& grid, const DistanceField& field, const Eigen::Isometry3d& by_tag,
                          const Eigen::Isometry3d& earlier) {
  const PoseEstimate anywhere{by_tag, PoseCovariance::Identity()};  // metres and radians: depth alone decides
  return surface_cost(grid, field, anywhere, earlier) - surface_cost(grid, field, anywhere, by_tag) >
         kTagMap.moved_sigmas * kTagMap.moved_sigmas;
}

std::optional<PoseEstimate> RestCheck::tag_crept(const capture::FrameSet& frame, const PoseEstimate& by_tag,
                                                 const DistanceField& field) {
  if (!frame.depth) return std::nullopt;
  const auto begin_here = [&] {
    earlier_ = by_tag;
    depth_ = frame.depth;
  };
  if (!earlier_) begin_here();
  const Step sigma = by_tag.covariance.diagonal().cwiseSqrt();
  if (!contradicts(step_between(earlier_->T_tag_camera, by_tag.T_tag_camera), sigma)) return std::nullopt;
  if (frame.time_ns >= checked_ns_ && frame.time_ns - checked_ns_ < kTagMap.rest_check_interval_ns) return std::nullopt;
  checked_ns_ = frame.time_ns;
  const DepthGrid grid = sampler_.sample(frame.depth->depth_m);
  if (surface_shows_motion(grid, field, by_tag.T_tag_camera, earlier_->T_tag_camera)) {
    begin_here();
    return std::nullopt;
  }
  const PoseCovariance expected =
      DepthTracking::predicted(earlier_->covariance, 1e-9 * static_cast<double>(kTagMap.rest_check_interval_ns));
  const auto then = align_to_field(sampler_.sample(depth_->depth_m), field,
                                   {earlier_->T_tag_camera, DepthTracking::predicted(earlier_->covariance, 0)});
  if (then) {
    const auto now = align_to_field(grid, field, {then->pose.T_tag_camera, expected});
    if (now) {
      // Poses from depth and from the print differ slightly: the earlier frame has both.
      PoseEstimate by_depth = now->pose;
      by_depth.T_tag_camera = by_depth.T_tag_camera * then->pose.T_tag_camera.inverse() * earlier_->T_tag_camera;
      if (tag_moved_alone(by_tag, by_depth, earlier_->T_tag_camera, expected)) return by_depth;
    }
  }
  begin_here();
  return std::nullopt;
}

}  // namespace lumigraft::reconstruct
