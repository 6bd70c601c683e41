#include "reconstruct/calibrate/bundle_adjustment.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr auto& kBundle = kCalibration.bundle_adjustment;
using Pose = std::array<double, 6>;  // rotation as axis times angle, then translation

Pose pose_of(const Isometry3d& T) {
  const Vector3d w = rotation_vector(T.linear()), t = T.translation();
  return {w.x(), w.y(), w.z(), t.x(), t.y(), t.z()};
}

Isometry3d isometry_of(const Pose& pose) {
  return isometry(rotation_by({pose[0], pose[1], pose[2]}), {pose[3], pose[4], pose[5]});
}

/// Whitened errors of N correlated points.
template <int N>
struct PointsCost {
  bool pinhole;
  const SeenPoints* seen;

  template <typename T>
  bool operator()(const T* lens, const T* T_camera_first, const T* T_first_board, T* residual) const {
    Eigen::Matrix<T, 2 * N, 1> error;
    for (int i = 0; i < N; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Eigen::Matrix<T, 3, 1> on_board = seen->points_m[at].template cast<T>();
      Eigen::Matrix<T, 3, 1> first, here;
      Eigen::Matrix<T, 2, 1> pixel;
      ceres::AngleAxisRotatePoint(T_first_board, on_board.data(), first.data());
      first += Eigen::Map<const Eigen::Matrix<T, 3, 1>>(T_first_board + 3);
      ceres::AngleAxisRotatePoint(T_camera_first, first.data(), here.data());
      here += Eigen::Map<const Eigen::Matrix<T, 3, 1>>(T_camera_first + 3);
      if (!project_through(pinhole, lens, here, pixel)) return false;
      error.template segment<2>(2 * i) = pixel - seen->pixels[at].template cast<T>();
    }
    const Eigen::Map<const Eigen::Matrix<double, 2 * N, 2 * N>> whitening(seen->whitening.data());
    Eigen::Map<Eigen::Matrix<T, 2 * N, 1>> whitened(residual);
    whitened = whitening.template cast<T>() * error;
    return true;
  }
};

/// The median of a sum of squares of independent unit normals (Wilson & Hilferty 1931).
double chi_square_median(double count) { return count * std::pow(1 - 2 / (9 * count), 3); }

class Adjuster {
 public:
  Adjuster(const Rig& rig, const RigViews& views, Freedom freedom) : rig_(rig), freedom_(freedom) {
    for (const capture::CameraModel& camera : rig.cameras) lenses_.push_back(lens_numbers(camera));
    for (const Isometry3d& T : rig.T_camera_first) camera_poses_.push_back(pose_of(T));
    for (const Isometry3d& T : rig.T_first_board) boards_.push_back(pose_of(T));
    for (std::size_t camera = 0; camera < views.size(); ++camera)
      for (std::size_t moment = 0; moment < views[camera].size(); ++moment)
        for (const SeenPoints& seen : views[camera][moment].seen) blocks_.push_back({camera, moment, &seen});
  }

  std::optional<Adjustment> run() {
    if (!measure()) return std::nullopt;
    // A robust loss at the current error scale, which is re-estimated in every round.
    for (int round = 0; round < kBundle.robust_rounds; ++round) {
      const double before = scale_;
      if (!solve(false) || !measure()) return std::nullopt;
      if (std::abs(scale_ - before) < kBundle.settled * scale_) break;
    }
    // Removes the outliers, then solves without a robust loss.
    for (Block& block : blocks_)
      block.outlier = block.error > scale_ * (block.width() + kBundle.outlier) && block.error_px > kBundle.min_px;
    if (!solve(true) || !measure()) return std::nullopt;
    return result();
  }

 private:
  struct Block {
    std::size_t camera, moment;
    const SeenPoints* seen;
    double error = 0;     ///< whitened
    double error_px = 0;  ///< RMS over the points
    bool outlier = false;

    double width() const { return std::sqrt(2.0 * static_cast<double>(seen->pixels.size())); }
  };

  /// Computes the error of every block and the scale from their median.
  bool measure() {
    std::vector<double> scales;
    for (Block& block : blocks_) {
      Eigen::VectorXd error(2 * static_cast<Eigen::Index>(block.seen->pixels.size()));
      const auto pixels = projected(block);
      if (!pixels) return false;
      for (std::size_t i = 0; i < pixels->size(); ++i)
        error.segment<2>(2 * static_cast<Eigen::Index>(i)) = (*pixels)[i] - block.seen->pixels[i];
      block.error = (block.seen->whitening * error).norm();
      block.error_px = error.norm() / std::sqrt(static_cast<double>(block.seen->pixels.size()));
      scales.push_back(block.error / std::sqrt(chi_square_median(static_cast<double>(error.size()))));
    }
    if (scales.empty()) return false;
    scale_ = std::max(median(scales), 1e-9);
    return std::isfinite(scale_);
  }

  std::optional<std::vector<Vector2d>> projected(const Block& block) const {
    const Isometry3d T = isometry_of(camera_poses_[block.camera]) * isometry_of(boards_[block.moment]);
    const bool pinhole = rig_.cameras[block.camera].kind == capture::CameraModel::Kind::pinhole;
    std::vector<Vector2d> pixels;
    for (const Vector3d& point : block.seen->points_m) {
      Vector2d pixel;
      if (!project_through(pinhole, lenses_[block.camera].data(), Vector3d(T * point), pixel)) return std::nullopt;
      pixels.push_back(pixel);
    }
    return pixels;
  }

  bool solve(bool final) {
    ceres::Problem problem;
    for (const Block& block : blocks_) {
      if (final && block.outlier) continue;
      const bool pinhole = rig_.cameras[block.camera].kind == capture::CameraModel::Kind::pinhole;
      ceres::CostFunction* cost =
          block.seen->pixels.size() == 4
              ? static_cast<ceres::CostFunction*>(new ceres::AutoDiffCostFunction<PointsCost<4>, 8, kLensNumbers, 6, 6>(
                    new PointsCost<4>{pinhole, block.seen}))
              : new ceres::AutoDiffCostFunction<PointsCost<1>, 2, kLensNumbers, 6, 6>(
                    new PointsCost<1>{pinhole, block.seen});
      problem.AddResidualBlock(cost, final ? nullptr : new ceres::HuberLoss(scale_ * (block.width() + kBundle.huber)),
                               lenses_[block.camera].data(), camera_poses_[block.camera].data(),
                               boards_[block.moment].data());
    }
    hold_still(problem);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.max_num_iterations = freedom_ == Freedom::poses ? kBundle.pose_iterations : kBundle.iterations;
    options.function_tolerance = kBundle.tolerance;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return false;
    return !final || freedom_ != Freedom::all || find_covariance(problem);
  }

  void hold_still(ceres::Problem& problem) {
    for (std::size_t i = 0; i < lenses_.size(); ++i) {
      if (!problem.HasParameterBlock(lenses_[i].data())) continue;
      if (i == 0 || freedom_ == Freedom::poses) problem.SetParameterBlockConstant(camera_poses_[i].data());
      if (freedom_ == Freedom::poses) {
        problem.SetParameterBlockConstant(lenses_[i].data());
        continue;
      }
      std::vector<int> still;
      if (freedom_ == Freedom::focal_length)
        still = {2, 3, 4, 5, 6, 7, 8};
      else if (rig_.cameras[i].kind != capture::CameraModel::Kind::pinhole)
        still = {8};
      if (!still.empty()) problem.SetManifold(lenses_[i].data(), new ceres::SubsetManifold(kLensNumbers, still));
    }
  }

  /// σ² (JᵀJ)⁻¹ with σ² from the residuals.
  bool find_covariance(ceres::Problem& problem) {
    ceres::Problem::EvaluateOptions options;
    std::vector<std::pair<double*, Eigen::Index>> wanted;  // with its first row in the result
    for (std::size_t i = 0; i < lenses_.size(); ++i)
      wanted.emplace_back(lenses_[i].data(), kLensNumbers * static_cast<Eigen::Index>(i));
    if (lenses_.size() > 1)
      wanted.emplace_back(camera_poses_[1].data(), kLensNumbers * static_cast<Eigen::Index>(lenses_.size()));
    covariance_.setZero(wanted.back().second + (lenses_.size() > 1 ? 6 : kLensNumbers),
                        wanted.back().second + (lenses_.size() > 1 ? 6 : kLensNumbers));
    std::vector<Eigen::Index> row_of;  // row of the result, by column of J
    for (const auto& [block, row] : wanted) {
      if (!problem.HasParameterBlock(block)) return false;
      options.parameter_blocks.push_back(block);
      for (int i = 0; i < problem.ParameterBlockTangentSize(block); ++i) row_of.push_back(row + i);
    }
    for (Pose& board : boards_)
      if (problem.HasParameterBlock(board.data())) options.parameter_blocks.push_back(board.data());
    double cost = 0;
    ceres::CRSMatrix j;
    if (!problem.Evaluate(options, &cost, nullptr, nullptr, &j)) return false;
    const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> jacobian(
        j.num_rows, j.num_cols, static_cast<Eigen::Index>(j.values.size()), j.rows.data(), j.cols.data(),
        j.values.data());
    const Eigen::MatrixXd jtj = jacobian.transpose() * jacobian;
    // Scales pixels, metres and coefficients of θ⁹ to one order of magnitude before the inversion.
    const Eigen::VectorXd size = jtj.diagonal().cwiseSqrt();
    if (!(size.minCoeff() > 0) || j.num_rows <= j.num_cols) return false;
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(size.cwiseInverse().asDiagonal() * jtj * size.cwiseInverse().asDiagonal());
    if (!ldlt.isPositive() || !(ldlt.vectorD().minCoeff() > kBundle.min_pivot)) return false;
    const Eigen::Index count = static_cast<Eigen::Index>(row_of.size());
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(j.num_cols, count);
    for (Eigen::Index i = 0; i < count; ++i) unit(i, i) = 1 / size[i];
    const Eigen::MatrixXd solved = size.cwiseInverse().asDiagonal() * ldlt.solve(unit);
    const double variance = 2 * cost / (j.num_rows - j.num_cols);
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index b = 0; b < count; ++b)
        covariance_(row_of[static_cast<std::size_t>(a)], row_of[static_cast<std::size_t>(b)]) = variance * solved(a, b);
    if (lenses_.size() > 1) turn_from_the_left();
    return covariance_.allFinite();
  }

  /// The second camera's rotation is parametrised as axis times angle w. A change dw is the left rotation J dw, with
  /// the left Jacobian J of SO(3) (Chirikjian 2012, eq. 10.86).
  void turn_from_the_left() {
    const Vector3d w(camera_poses_[1][0], camera_poses_[1][1], camera_poses_[1][2]);
    const double angle = w.norm();
    if (angle < 1e-9) return;
    const Vector3d axis = w / angle;
    Eigen::Matrix3d cross;
    cross << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
    const double sinc = std::sin(angle) / angle;
    Eigen::MatrixXd j = Eigen::MatrixXd::Identity(covariance_.rows(), covariance_.cols());
    j.block<3, 3>(2 * kLensNumbers, 2 * kLensNumbers) = sinc * Eigen::Matrix3d::Identity() +
                                                        (1 - sinc) * axis * axis.transpose() +
                                                        (1 - std::cos(angle)) / angle * cross;
    covariance_ = j * covariance_ * j.transpose();
  }

  Adjustment result() const {
    Adjustment out;
    out.rig = rig_;
    out.covariance = covariance_;
    for (std::size_t i = 0; i < lenses_.size(); ++i) {
      if (freedom_ != Freedom::poses) out.rig.cameras[i] = with_lens(rig_.cameras[i], lenses_[i]);
      out.rig.T_camera_first[i] = isometry_of(camera_poses_[i]);
    }
    for (std::size_t i = 0; i < boards_.size(); ++i) out.rig.T_first_board[i] = isometry_of(boards_[i]);
    for (const Block& block : blocks_) {
      const auto pixels = *projected(block);
      for (std::size_t i = 0; i < pixels.size(); ++i)
        out.residuals.push_back({static_cast<int>(block.camera), static_cast<int>(block.moment), block.seen->pixels[i],
                                 pixels[i] - block.seen->pixels[i], block.outlier});
    }
    return out;
  }

  Rig rig_;
  Freedom freedom_;
  std::vector<LensNumbers> lenses_;
  std::vector<Pose> camera_poses_, boards_;
  std::vector<Block> blocks_;
  double scale_ = 1;
  Eigen::MatrixXd covariance_;
};

}  // namespace

std::optional<Adjustment> adjust(const Rig& rig, const RigViews& views, Freedom freedom) {
  return Adjuster(rig, views, freedom).run();
}

}  // namespace lumigraft::reconstruct
