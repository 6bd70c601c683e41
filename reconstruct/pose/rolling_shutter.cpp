#include "reconstruct/pose/rolling_shutter.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <utility>

#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/tag_search.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) { return 1e-9 * static_cast<double>(to_ns - from_ns); }

struct Flow {
  Vector2d velocity = Vector2d::Zero();  ///< at the mean of the points
  Matrix2d gradient = Matrix2d::Zero();
};

/// Least squares of a velocity that is linear in the image.
Flow linear_flow(const TagCorners& points, const TagCorners& velocities) {
  Flow flow;
  flow.velocity = centre_of(velocities);
  const Vector2d centre = centre_of(points);
  Matrix2d moments = Matrix2d::Zero(), products = Matrix2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2d arm = points[i] - centre;
    moments += arm * arm.transpose();
    products += (velocities[i] - flow.velocity) * arm.transpose();
  }
  flow.gradient = products * moments.inverse();
  if (!flow.gradient.allFinite()) flow.gradient.setZero();
  return flow;
}

}  // namespace

RowTime RowTime::of(const std::optional<double>& readout_s, int rows) {
  const double intervals = std::max(rows - 1, 1);
  if (readout_s) return {*readout_s / intervals, 0};
  return {0, kRollingShutter.unknown_readout_s / intervals};
}

void limit_to_common_motion(std::vector<ImageMotion>& motions, const std::vector<bool>& seen) {
  double slowest_px_s = std::numeric_limits<double>::infinity(), surest_px_s = slowest_px_s;
  for (std::size_t tag = 0; tag < motions.size(); ++tag) {
    if (!seen[tag]) continue;
    slowest_px_s = std::min(slowest_px_s, motions[tag].velocity_px_s.norm());
    surest_px_s = std::min(surest_px_s, motions[tag].velocity_sigma_px_s);
  }
  for (std::size_t tag = 0; tag < motions.size(); ++tag) {
    ImageMotion& motion = motions[tag];
    if (!seen[tag]) continue;
    motion.velocity_sigma_px_s = std::min(motion.velocity_sigma_px_s, surest_px_s);
    const double speed_px_s = motion.velocity_px_s.norm();
    if (!(motion.row_time.sigma_s > 0) || !(speed_px_s > slowest_px_s)) continue;  // else points are moved by it
    motion.velocity_px_s *= slowest_px_s / speed_px_s;
    motion.gradient_per_s *= slowest_px_s / speed_px_s;
  }
}

ImageMotion TagImageMotion::update(const std::optional<TagCorners>& seen, const std::optional<Expected>& expected,
                                   double row, std::int64_t now_ns, const RowTime& row_time, double usual_px_s) {
  ImageMotion motion{.row = row, .row_time = row_time};
  if (seen || expected) motion.centre = centre_of(seen ? *seen : expected->corners);
  const std::optional<Expected> before = std::exchange(before_, expected);
  const double last_change_px_s = std::exchange(change_px_s_, 0);
  const double elapsed_s = expected ? seconds_between(expected->pose_ns, now_ns) : 0;
  if (!(elapsed_s > 0)) {
    motion.velocity_sigma_px_s = usual_px_s;
    return motion;
  }
  // Between the last two poses.
  std::optional<Flow> past;
  const double past_s = before ? seconds_between(before->pose_ns, expected->pose_ns) : 0;
  if (past_s > 0) {
    TagCorners velocities;
    for (std::size_t i = 0; i < velocities.size(); ++i)
      velocities[i] = (expected->corners[i] - before->corners[i]) / past_s;
    past = linear_flow(expected->corners, velocities);
    motion.gradient_per_s = past->gradient;
  }
  if (!seen) {
    motion.velocity_px_s = past ? past->velocity : Vector2d::Zero();
    motion.velocity_sigma_px_s = past ? past->velocity.norm() : usual_px_s;
    return motion;
  }
  // Each corner has moved until its own row was exposed.
  TagCorners velocities;
  for (std::size_t i = 0; i < velocities.size(); ++i)
    velocities[i] = ((*seen)[i] - expected->corners[i]) / (elapsed_s + ((*seen)[i].y() - row) * row_time.seconds);
  motion.velocity_px_s = centre_of(velocities);
  if (past) {
    // The mean over an interval is the velocity at its middle; the motion is taken to accelerate evenly.
    const Vector2d change = elapsed_s / (elapsed_s + past_s) * (motion.velocity_px_s - past->velocity);
    motion.velocity_px_s += change;
    // The acceleration changes as well: of a hand that shakes, most where it is small.
    change_px_s_ = change.norm();
    motion.velocity_sigma_px_s = std::max(change_px_s_, last_change_px_s);
  } else {
    motion.velocity_sigma_px_s = motion.velocity_px_s.norm();  // it may have begun to move, or be about to stop
  }
  motion.velocity_sigma_px_s += expected->sigma_px / elapsed_s;
  return motion;
}

}  // namespace lumigraft::reconstruct
