#include "reconstruct/pose/icp.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "reconstruct/field/slope_lookup.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Isometry3f;
using Eigen::Vector3f;
using Row = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

/// Change of the distance to a plane with the pose. `arm`: vector from the camera to the point, tag frame.
Row row_of(const Vector3f& normal, const Vector3f& arm) {
  Eigen::Matrix<float, 6, 1> row;
  row << normal, arm.cross(normal);
  return row.cast<double>();
}

/// Tukey's biweight over the variance.
double tukey_weight(float residual_m, float sigma_m, float gate_m) {
  const float ratio = residual_m / gate_m, bisquare = 1 - ratio * ratio;
  return static_cast<double>(bisquare * bisquare / (sigma_m * sigma_m));
}

/// Normal equations of a Gauss-Newton step over point-to-plane distances. Points are in single precision, which is more
/// exact than depth; the sums are in double precision.
struct NormalEquations {
  Square information = Square::Zero();  ///< its lower half
  Row gradient = Row::Zero();
  int points = 0;

  /// `arm`: vector from the camera to the point, tag frame.
  void add(float residual_m, const Vector3f& normal, const Vector3f& arm, float sigma_m, float gate_m) {
    const double weight = tukey_weight(residual_m, sigma_m, gate_m);
    const Row j = row_of(normal, arm), weighted = weight * j;
    for (int column = 0; column < 6; ++column)
      for (int row = column; row < 6; ++row) information(row, column) += weighted[row] * j[column];
    gradient += static_cast<double>(residual_m) * weighted;
    ++points;
  }
  /// The step from `pose`, with the prior `expected` of information `prior`.
  std::optional<Row> step(const Isometry3d& pose, const PoseEstimate& expected, const Square& prior) const {
    const Square full = information.selfadjointView<Eigen::Lower>();
    const Square sum = full / kIcp.correlation + prior;
    const Row right = prior * step_between(pose, expected.T_tag_camera) - gradient / kIcp.correlation;
    const Row result = solved(sum, right);
    return result.allFinite() ? std::optional(result) : std::nullopt;
  }
};

/// What distances to the surface say about the pose, by the method of moments (Hansen 1982, "Large sample properties of
/// generalized method of moments estimators"): Σ w z r vanishes at the true pose, where r are the distances and z their
/// changes with the pose by the normals of the depth image. Squares of the field's noisy normals would pretend that a
/// bare plane determines all of the pose. Noise of the field's and of the image's normals is independent, so it cancels
/// in their products.
class SurfaceMoments {
 public:
  /// `by_image`, `by_field`: change of the distance by both normals. `plane`: not at a rim or crease, so that both
  /// normals differ by noise alone.
  void add(double residual_m, double weight, const Row& by_image, const Row& by_field, bool plane) {
    slope_.noalias() += (weight * by_image) * by_field.transpose();
    of_noise_.noalias() += (weight * by_image) * by_image.transpose();
    block_ += weight * residual_m * by_image;
    misfit_ += weight * residual_m * residual_m;
    ++points_;
    if (plane) planes_.push_back({weight, by_image - by_field});
  }
  void end_block() {
    if (block_.isZero()) return;
    sum_ += block_;
    of_blocks_.noalias() += block_ * block_.transpose();
    block_.setZero();
    ++blocks_;
  }
  /// The pose from these moments and the prior.
  std::optional<PoseEstimate> pose(const Isometry3d& at, const PoseEstimate& expected, const Square& prior) const {
    // Two estimates: their mean. The blocks' sums are too small, since six unknowns were fitted; few blocks are too
    // few.
    Square noise = kIcp.correlation * of_noise_;
    if (blocks_ >= kIcp.min_blocks) noise = (noise + of_blocks_ * (blocks_ / (blocks_ - 6.0))) / 2;
    // A camera with more noise than the model's has made the field with it, too.
    noise *= std::max(1.0, misfit_ / points_);
    const Square inverse = information_of(noise);
    // Variance of the slope due to the normals' noise, ε and η: E[ε²η²] is at most a twelfth of E[(ε - η)⁴]. Directions
    // with a slope below some standard errors are undetermined, and so are those in which the prior is far more
    // certain.
    constexpr double kErrors = kIcp.undetermined_errors;
    Square slope_noise = Square::Zero();
    for (const Point& p : planes_)
      slope_noise.noalias() +=
          (p.weight * p.weight * p.difference.dot(inverse * p.difference) * p.difference) * p.difference.transpose();
    slope_noise *= kIcp.correlation / 12 * points_ / std::max<std::size_t>(1, planes_.size());
    const Square weighted = slope_.transpose() * inverse, all = weighted * slope_;
    const Square determined = larger_part(all, kErrors * kErrors * slope_noise + kIcp.min_gain * prior);
    const Square information = determined * all * determined.transpose() + prior;
    const Row step =
        solved(information, prior * step_between(at, expected.T_tag_camera) - determined * weighted * sum_);
    if (!step.allFinite()) return std::nullopt;
    PoseEstimate result{apply_step(at, step), information_of(information)};
    result.T_tag_camera.linear() = Eigen::Quaterniond(result.T_tag_camera.linear()).normalized().toRotationMatrix();
    return result;
  }

 private:
  struct Point {
    double weight;
    Row difference;  ///< of both normals
  };
  Square slope_ = Square::Zero();  ///< of the sum by the pose
  Row sum_ = Row::Zero(), block_ = Row::Zero();
  Square of_noise_ = Square::Zero();   ///< covariance of the sum, from the modelled noise
  Square of_blocks_ = Square::Zero();  ///< the same from blocks of the image (White 1980): what is not modelled
  int blocks_ = 0;
  double misfit_ = 0;  ///< sum of squared residuals over the model's variance
  double points_ = 0;
  std::vector<Point> planes_;  ///< points on planes
};

/// A point on the surface.
struct Match {
  Vector3f arm, normal;  ///< from the camera to the point; of the surface, tag frame
  float residual_m, sigma_m, gate_m;
};

/// Tukey's biweight as a squared residual over its variance; beyond the gate it is constant.
double tukey_cost(float residual_m, float sigma_m, float gate_m) {
  const float ratio = residual_m / gate_m, gate = gate_m / sigma_m, left = std::max(1 - ratio * ratio, 0.0f);
  return static_cast<double>(gate * gate / 3 * (1 - left * left * left));
}

/// Finds the surface at points of a depth image.
struct Matcher {
  const DistanceField& field;
  SlopeLookup& slope_at;  ///< of that field
  const Isometry3f T_tag_camera;
  const bool wide;  ///< within the truncation distance, else within the noise
  int known = 0;    ///< points so far where the field is known

  std::optional<Match> operator()(const DepthGrid::Point& point) {
    const Vector3f arm = T_tag_camera.linear() * point.position;
    const auto slope = slope_at(T_tag_camera.translation() + arm);
    if (!slope) return std::nullopt;
    ++known;
    const auto [sigma_m, gate_m] = noise(point);
    if (std::abs(slope->distance_m) >= gate_m) return std::nullopt;
    // Between a front and a back the gradient is short and has no meaning.
    const float length = slope->gradient.norm();
    if (length < kIcp.min_gradient) return std::nullopt;
    return Match{arm, slope->gradient / length, slope->distance_m / length, sigma_m, gate_m};
  }

  struct Noise {
    float sigma_m, gate_m;
  };
  Noise noise(const DepthGrid::Point& point) const {
    const float sigma_m = std::hypot(point.sigma_m, static_cast<float>(kIcp.field_sigma_voxels) * field.voxel_m);
    const float reach_m = kIcp.reach * field.truncation_m;
    return {sigma_m, wide ? reach_m : std::min(reach_m, kIcp.gate_sigmas * sigma_m)};
  }
};

/// The surface's normal near a point, from voxels that other pixels measured.
std::optional<Vector3f> normal_aside(Matcher& matched, const Vector3f& position_m, const Vector3f& normal) {
  const Vector3f aside = kIcp.aside_voxels * matched.field.voxel_m * normal.unitOrthogonal();
  Vector3f gradient = Vector3f::Zero();
  for (const Vector3f& at : {Vector3f(position_m + aside), Vector3f(position_m - aside)})
    if (const auto slope = matched.slope_at(at)) gradient += slope->gradient;
  return gradient.norm() < kIcp.min_gradient ? std::nullopt : std::optional<Vector3f>(gradient.normalized());
}

SurfaceMoments moments_of(const DepthGrid& grid, Matcher matched) {
  SurfaceMoments moments;
  constexpr int kSize = kIcp.block_points;
  // At the image border a plane looks like a rim.
  for (int block_row = 1; block_row < grid.rows; block_row += kSize)
    for (int block_column = 1; block_column < grid.columns; block_column += kSize) {
      for (int r = block_row; r < std::min(grid.rows - 1, block_row + kSize); ++r)
        for (int c = block_column + r % 2; c < std::min(grid.columns - 1, block_column + kSize); c += 2) {
          const DepthGrid::Point& point = grid.at(c, r);
          const auto match = point.position.z() > 0 ? matched(point) : std::nullopt;
          if (!match) continue;
          const Vector3f seen = matched.T_tag_camera.linear() * point.normal;
          // Rims and creases have no normal in the depth image.
          const auto second = !point.normal.isZero()
                                  ? std::optional(seen)
                                  : normal_aside(matched, matched.T_tag_camera * point.position, match->normal);
          if (!second || (!point.normal.isZero() && match->normal.dot(seen) < kIcp.min_normal_cosine)) continue;
          const double weight = tukey_weight(match->residual_m, match->sigma_m, match->gate_m);
          moments.add(static_cast<double>(match->residual_m), weight, row_of(*second, match->arm),
                      row_of(match->normal, match->arm), !point.normal.isZero());
        }
      moments.end_block();
    }
  return moments;
}

bool shorter(const Row& step, double size) { return step.head<3>().norm() < size && step.tail<3>().norm() < size; }
bool converged(const Row& step) { return shorter(step, kIcp.converged); }
bool nearly_converged(const Row& step) { return shorter(step, kIcp.nearly_converged); }

}  // namespace

std::optional<SurfaceFit> align_to_field(const DepthGrid& grid, const DistanceField& field,
                                         const PoseEstimate& expected, const std::optional<Isometry3d>& start) {
  const Square prior = information_of(expected.covariance);
  Isometry3d pose = start.value_or(expected.T_tag_camera);
  SlopeLookup slope_at(field);
  int points = 0, measured = 0, known = 0;
  // The first rounds use every fourth point with a wide gate, the last ones every second point with a narrow gate.
  bool coarse = true;
  for (int round = 0; round < kIcp.max_rounds; ++round) {
    const int row_stride = coarse ? 2 : 1;
    Matcher matched{field, slope_at, pose.cast<float>(), coarse};
    NormalEquations sums;
    measured = 0;
    for (int r = 0; r < grid.rows; r += row_stride)
      for (int c = (r / row_stride) % 2; c < grid.columns; c += 2) {
        const DepthGrid::Point& point = grid.at(c, r);
        if (point.position.z() == 0) continue;
        ++measured;
        if (const auto match = matched(point))
          sums.add(match->residual_m, match->normal, match->arm, match->sigma_m, match->gate_m);
      }
    points = sums.points;
    known = matched.known;
    if (points * row_stride < kIcp.min_points) return std::nullopt;
    const auto step = sums.step(pose, expected, prior);
    if (!step) return std::nullopt;
    pose = apply_step(pose, *step);
    if (!coarse && converged(*step)) break;
    if (round == kIcp.max_coarse_rounds - 1 || (coarse && nearly_converged(*step))) coarse = false;
  }
  const double inlier_fraction = static_cast<double>(points) / std::max(1, measured);
  if (inlier_fraction < kIcp.min_inliers || points < kIcp.min_agreement * known) return std::nullopt;
  // Twice, since the linearization at the pose of the noisy normals is not exact.
  std::optional<PoseEstimate> fit;
  for (int round = 0; round < 2; ++round) {
    fit = moments_of(grid, {field, slope_at, pose.cast<float>(), false}).pose(pose, expected, prior);
    if (!fit) return std::nullopt;
    pose = fit->T_tag_camera;
  }
  return SurfaceFit{*fit, inlier_fraction};
}

double surface_cost(const DepthGrid& grid, const DistanceField& field, const PoseEstimate& expected,
                    const Isometry3d& pose) {
  SlopeLookup slope_at(field);
  Matcher matched{field, slope_at, pose.cast<float>(), false};
  double sum = 0;
  for (int r = 0; r < grid.rows; ++r)
    for (int c = r % 2; c < grid.columns; c += 2) {
      const DepthGrid::Point& point = grid.at(c, r);
      if (point.position.z() == 0) continue;
      const auto match = matched(point);
      const auto [sigma_m, gate_m] = matched.noise(point);
      sum += tukey_cost(match ? match->residual_m : gate_m, sigma_m, gate_m);
    }
  const Row off = step_between(expected.T_tag_camera, pose);
  return sum / kIcp.correlation + off.dot(information_of(expected.covariance) * off);
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
