#include "reconstruct/pose/icp.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Isometry3f;
using Eigen::Vector3f;
using Row = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

/// Residuals call noise independent from point to point, but depth errs together over whole parts of the picture.
constexpr double kTogether = 6;
constexpr double kFieldNoise = 0.1;  // 1σ of the field's distance, in voxels
constexpr int kFewest = 200;         // points on the surface
constexpr double kLeastShare = 0.15;
constexpr double kLeastAgreement = 0.4;  // of the points where the field is known, on the surface

/// Sums of a Gauss-Newton step over point-to-plane distances. Single precision loses nothing that depth knew; the sums
/// themselves are doubles.
struct Sums {
  Square information = Square::Zero();
  Row gradient = Row::Zero();
  int points = 0;

  /// `arm` from the camera to the point, along the tag's axes.
  void add(float residual_m, const Vector3f& normal, const Vector3f& arm, float sigma_m, float gate_m) {
    const float share = residual_m / gate_m, falling = 1 - share * share;
    const float weight = falling * falling / (sigma_m * sigma_m);  // Tukey's biweight
    Eigen::Matrix<float, 6, 1> row;
    row << normal, arm.cross(normal);
    const Row j = row.cast<double>();
    information.noalias() += (static_cast<double>(weight) * j) * j.transpose();
    gradient += static_cast<double>(weight * residual_m) * j;
    ++points;
  }
  /// With what is expected beside: the step from `pose`.
  std::optional<Row> step(const Isometry3d& pose, const PoseEstimate& expected, const Square& certainty) const {
    const Square sum = information / kTogether + certainty;
    const Row right = certainty * step_between(pose, expected.T_tag_camera) - gradient / kTogether;
    const Row result = solved(sum, right);
    return result.allFinite() ? std::optional(result) : std::nullopt;
  }
};

bool within(const Row& step, double size) { return step.head<3>().norm() < size && step.tail<3>().norm() < size; }
bool settled(const Row& step) { return within(step, 1e-4); }  // the next step would be far smaller
bool nearly_settled(const Row& step) { return within(step, 2e-3); }

}  // namespace

std::optional<SurfaceFit> align_to_field(const DepthGrid& grid, const DistanceField& field,
                                         const PoseEstimate& expected) {
  const Square certainty = information_of(expected.covariance);
  const float noise_m = static_cast<float>(kFieldNoise) * field.voxel_m, reach_m = 0.95f * field.truncation_m;
  Isometry3d pose = expected.T_tag_camera;
  Sums sums;
  int measured = 0, known = 0;
  // First rounds on every fourth point, with everything in reach; the last ones on every second, and what is near
  // alone.
  bool coarse = true;
  for (int round = 0; round < 12; ++round) {
    const int row_stride = coarse ? 2 : 1;
    const Isometry3f T_tag_camera = pose.cast<float>();
    sums = Sums();
    measured = known = 0;
    for (int r = 0; r < grid.rows; r += row_stride)
      for (int c = (r / row_stride) % 2; c < grid.columns; c += 2) {
        const DepthGrid::Point& point = grid.at(c, r);
        if (point.place.z() == 0) continue;
        ++measured;
        const Vector3f arm = T_tag_camera.linear() * point.place;
        const auto slope = field.slope(T_tag_camera.translation() + arm);
        if (!slope) continue;
        ++known;
        const float sigma_m = std::hypot(point.sigma_m, noise_m);
        const float gate_m = coarse ? reach_m : std::min(reach_m, 5 * sigma_m);
        if (std::abs(slope->distance_m) >= gate_m) continue;
        // Between a front and a back the field has no slope, and says nothing.
        const float length = slope->gradient.norm();
        if (length < 0.5f) continue;
        sums.add(slope->distance_m / length, slope->gradient / length, arm, sigma_m, gate_m);
      }
    if (sums.points * row_stride < kFewest) return std::nullopt;
    const auto step = sums.step(pose, expected, certainty);
    if (!step) return std::nullopt;
    pose = apply_step(pose, *step);
    if (!coarse && settled(*step)) break;
    if (round == 7 || (coarse && nearly_settled(*step))) coarse = false;
  }
  SurfaceFit fit;
  fit.shared = static_cast<double>(sums.points) / std::max(1, measured);
  if (fit.shared < kLeastShare || sums.points < kLeastAgreement * known) return std::nullopt;
  fit.pose.T_tag_camera = pose;
  fit.pose.T_tag_camera.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  fit.pose.covariance = information_of(sums.information / kTogether + certainty);
  return fit;
}

Isometry3d align_to_picture(const DepthGrid& grid, const DepthGrid& earlier, const capture::CameraModel& camera,
                            const Isometry3d& earlier_T_tag_camera, const PoseEstimate& expected) {
  const Square certainty = information_of(expected.covariance);
  const Eigen::Matrix3f to_tag = earlier_T_tag_camera.linear().cast<float>();
  Isometry3d pose = expected.T_tag_camera;
  for (int round = 0; round < 10; ++round) {
    const float gate_m = round < 4 ? 0.25f : 0.08f;
    const Isometry3f T_tag_camera = pose.cast<float>();
    const Isometry3f T_earlier_camera = (earlier_T_tag_camera.inverse() * pose).cast<float>();
    Sums sums;
    int measured = 0;
    for (int r = 0; r < grid.rows; r += 2)
      for (int c = 0; c < grid.columns; c += 2) {
        const DepthGrid::Point& point = grid.at(c, r);
        if (point.normal.isZero()) continue;
        ++measured;
        const Vector3f seen = T_earlier_camera * point.place;
        if (seen.z() < 0.05f) continue;
        // The grids are coarse, and planes reach beyond their cells: distortion may be left out.
        const float u = static_cast<float>(camera.fx) * seen.x() / seen.z() + static_cast<float>(camera.cx);
        const float v = static_cast<float>(camera.fy) * seen.y() / seen.z() + static_cast<float>(camera.cy);
        const float column = u / static_cast<float>(grid.step), row = v / static_cast<float>(grid.step);
        if (!(column >= 0 && row >= 0 && column < static_cast<float>(grid.columns) &&
              row < static_cast<float>(grid.rows)))
          continue;
        const DepthGrid::Point& met = earlier.at(static_cast<int>(column), static_cast<int>(row));
        if (met.normal.isZero()) continue;
        const Vector3f normal = T_earlier_camera.linear() * point.normal;
        if (normal.dot(met.normal) < 0.8f) continue;
        const float residual_m = met.normal.dot(seen - met.place);
        if (std::abs(residual_m) >= gate_m || (seen - met.place).norm() > 2 * gate_m) continue;
        // Points meet others beside them: a centimetre of noise, whatever depth's own.
        sums.add(residual_m, to_tag * met.normal, T_tag_camera.linear() * point.place, 0.01f, gate_m);
      }
    if (4 * sums.points < kFewest || sums.points < kLeastShare * measured) return expected.T_tag_camera;
    const auto step = sums.step(pose, expected, certainty);
    if (!step) return expected.T_tag_camera;
    pose = apply_step(pose, *step);
    if (settled(*step)) break;
  }
  return pose;
}

}  // namespace lumigraft::reconstruct
