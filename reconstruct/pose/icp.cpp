#include "reconstruct/pose/icp.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Isometry3f;
using Eigen::Vector3f;
using Row = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

/// Normal equations of a Gauss-Newton step over point-to-plane distances. Points are in single precision, which is more
/// exact than depth; the sums are in double precision.
struct NormalEquations {
  Square information = Square::Zero();
  Row gradient = Row::Zero();
  int points = 0;

  /// `arm`: vector from the camera to the point, tag frame.
  void add(float residual_m, const Vector3f& normal, const Vector3f& arm, float sigma_m, float gate_m) {
    const float ratio = residual_m / gate_m, bisquare = 1 - ratio * ratio;
    const float weight = bisquare * bisquare / (sigma_m * sigma_m);  // Tukey's biweight
    Eigen::Matrix<float, 6, 1> row;
    row << normal, arm.cross(normal);
    const Row j = row.cast<double>();
    information.noalias() += (static_cast<double>(weight) * j) * j.transpose();
    gradient += static_cast<double>(weight * residual_m) * j;
    ++points;
  }
  /// The step from `pose`, with the prior `expected` of information `prior`.
  std::optional<Row> step(const Isometry3d& pose, const PoseEstimate& expected, const Square& prior) const {
    const Square sum = information / kIcp.correlation + prior;
    const Row right = prior * step_between(pose, expected.T_tag_camera) - gradient / kIcp.correlation;
    const Row result = solved(sum, right);
    return result.allFinite() ? std::optional(result) : std::nullopt;
  }
};

bool shorter(const Row& step, double size) { return step.head<3>().norm() < size && step.tail<3>().norm() < size; }
bool converged(const Row& step) { return shorter(step, kIcp.converged); }
bool nearly_converged(const Row& step) { return shorter(step, kIcp.nearly_converged); }

}  // namespace

std::optional<SurfaceFit> align_to_field(const DepthGrid& grid, const DistanceField& field,
                                         const PoseEstimate& expected) {
  const Square prior = information_of(expected.covariance);
  const float noise_m = static_cast<float>(kIcp.field_sigma_voxels) * field.voxel_m,
              reach_m = kIcp.reach * field.truncation_m;
  Isometry3d pose = expected.T_tag_camera;
  NormalEquations sums;
  int measured = 0, known = 0;
  // The first rounds use every fourth point with a wide gate, the last ones every second point with a narrow gate.
  bool coarse = true;
  for (int round = 0; round < kIcp.max_rounds; ++round) {
    const int row_stride = coarse ? 2 : 1;
    const Isometry3f T_tag_camera = pose.cast<float>();
    sums = NormalEquations();
    measured = known = 0;
    for (int r = 0; r < grid.rows; r += row_stride)
      for (int c = (r / row_stride) % 2; c < grid.columns; c += 2) {
        const DepthGrid::Point& point = grid.at(c, r);
        if (point.position.z() == 0) continue;
        ++measured;
        const Vector3f arm = T_tag_camera.linear() * point.position;
        const auto slope = field.slope(T_tag_camera.translation() + arm);
        if (!slope) continue;
        ++known;
        const float sigma_m = std::hypot(point.sigma_m, noise_m);
        const float gate_m = coarse ? reach_m : std::min(reach_m, kIcp.gate_sigmas * sigma_m);
        if (std::abs(slope->distance_m) >= gate_m) continue;
        // Between a front and a back the gradient is short and has no meaning.
        const float length = slope->gradient.norm();
        if (length < kIcp.min_gradient) continue;
        sums.add(slope->distance_m / length, slope->gradient / length, arm, sigma_m, gate_m);
      }
    if (sums.points * row_stride < kIcp.min_points) return std::nullopt;
    const auto step = sums.step(pose, expected, prior);
    if (!step) return std::nullopt;
    pose = apply_step(pose, *step);
    if (!coarse && converged(*step)) break;
    if (round == kIcp.max_coarse_rounds - 1 || (coarse && nearly_converged(*step))) coarse = false;
  }
  SurfaceFit fit;
  fit.inlier_fraction = static_cast<double>(sums.points) / std::max(1, measured);
  if (fit.inlier_fraction < kIcp.min_inliers || sums.points < kIcp.min_agreement * known) return std::nullopt;
  fit.pose.T_tag_camera = pose;
  fit.pose.T_tag_camera.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  fit.pose.covariance = information_of(sums.information / kIcp.correlation + prior);
  return fit;
}

Isometry3d align_to_frame(const DepthGrid& grid, const DepthGrid& earlier, const capture::CameraModel& camera,
                          const Isometry3d& earlier_T_tag_camera, const PoseEstimate& expected) {
  const Square prior = information_of(expected.covariance);
  const Eigen::Matrix3f to_tag = earlier_T_tag_camera.linear().cast<float>();
  Isometry3d pose = expected.T_tag_camera;
  for (int round = 0; round < kIcp.frame_rounds; ++round) {
    const float gate_m = round < kIcp.wide_frame_rounds ? kIcp.wide_gate_m : kIcp.gate_m;
    const Isometry3f T_tag_camera = pose.cast<float>();
    const Isometry3f T_earlier_camera = (earlier_T_tag_camera.inverse() * pose).cast<float>();
    NormalEquations sums;
    int measured = 0;
    for (int r = 0; r < grid.rows; r += 2)
      for (int c = 0; c < grid.columns; c += 2) {
        const DepthGrid::Point& point = grid.at(c, r);
        if (point.normal.isZero()) continue;
        ++measured;
        const Vector3f in_earlier = T_earlier_camera * point.position;
        if (in_earlier.z() < kIcp.min_range_m) continue;
        // Lens distortion is ignored: the grids are coarse, and planes extend beyond their cells.
        const float u = static_cast<float>(camera.fx) * in_earlier.x() / in_earlier.z() + static_cast<float>(camera.cx);
        const float v = static_cast<float>(camera.fy) * in_earlier.y() / in_earlier.z() + static_cast<float>(camera.cy);
        const float column = u / static_cast<float>(grid.step), row = v / static_cast<float>(grid.step);
        if (!(column >= 0 && row >= 0 && column < static_cast<float>(grid.columns) &&
              row < static_cast<float>(grid.rows)))
          continue;
        const DepthGrid::Point& match = earlier.at(static_cast<int>(column), static_cast<int>(row));
        if (match.normal.isZero()) continue;
        const Vector3f normal = T_earlier_camera.linear() * point.normal;
        if (normal.dot(match.normal) < kIcp.min_normal_cosine) continue;
        const float residual_m = match.normal.dot(in_earlier - match.position);
        if (std::abs(residual_m) >= gate_m || (in_earlier - match.position).norm() > 2 * gate_m) continue;
        sums.add(residual_m, to_tag * match.normal, T_tag_camera.linear() * point.position, kIcp.frame_sigma_m, gate_m);
      }
    if (4 * sums.points < kIcp.min_points || sums.points < kIcp.min_inliers * measured) return expected.T_tag_camera;
    const auto step = sums.step(pose, expected, prior);
    if (!step) return expected.T_tag_camera;
    pose = apply_step(pose, *step);
    if (converged(*step)) break;
  }
  return pose;
}

}  // namespace lumigraft::reconstruct
