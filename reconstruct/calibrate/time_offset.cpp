#include "reconstruct/calibrate/time_offset.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "reconstruct/calibrate/acceptance.h"
#include "reconstruct/calibrate/initial_guess.h"
#include "reconstruct/calibrate/lens.h"
#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr auto& kTime = kCalibration.time_offset;
constexpr std::size_t kUnknowns = 7;  // the offset; rotation and translation of T_second_first

struct TimedPose {
  double time_s = 0;
  Isometry3d T_first_board;
};

/// Four consecutive poses, relative to the second.
struct Stretch {
  double from_s = 0, to_s = 0;   ///< times of the second and the third pose
  Isometry3d T_first_board;      ///< pose of the second
  std::array<double, 4> time_s;  ///< after from_s
  std::array<Vector3d, 4> turn, shift;

  /// Evaluates Lagrange's cubic through the four poses at a time after from_s.
  template <typename T>
  void at(const T& time, Eigen::Matrix<T, 3, 1>& w, Eigen::Matrix<T, 3, 1>& t) const {
    w.setZero();
    t.setZero();
    for (std::size_t i = 0; i < 4; ++i) {
      T weight(1);
      for (std::size_t k = 0; k < 4; ++k)
        if (k != i) weight *= (time - T(time_s[k])) / T(time_s[i] - time_s[k]);
      w += weight * turn[i].template cast<T>();
      t += weight * shift[i].template cast<T>();
    }
  }
};

std::vector<Stretch> stretches_of(const std::vector<TimedPose>& path) {
  std::vector<Stretch> stretches;
  for (std::size_t i = 1; i + 2 < path.size(); ++i) {
    bool continuous = true;
    for (std::size_t k = i - 1; k < i + 2; ++k) {
      const double gap_s = path[k + 1].time_s - path[k].time_s;
      continuous &= gap_s > 0 && gap_s <= kTime.max_gap_s;
    }
    if (!continuous) continue;
    Stretch& s = stretches.emplace_back();
    s.from_s = path[i].time_s;
    s.to_s = path[i + 1].time_s;
    s.T_first_board = path[i].T_first_board;
    for (std::size_t k = 0; k < 4; ++k) {
      const TimedPose& pose = path[i - 1 + k];
      s.time_s[k] = pose.time_s - s.from_s;
      s.turn[k] = rotation_vector(s.T_first_board.linear().transpose() * pose.T_first_board.linear());
      s.shift[k] = pose.T_first_board.translation() - s.T_first_board.translation();
    }
  }
  return stretches;
}

/// Reprojection error of a point that the second camera saw at `seen_s` after from_s, by its own clock.
struct Cost {
  bool pinhole;
  const LensNumbers* lens;
  const Stretch* stretch;
  double seen_s;
  Vector3d on_board;
  Vector2d pixel;

  template <typename T>
  bool operator()(const T* unknowns, T* residual) const {
    Eigen::Matrix<T, 3, 1> w, t, turned, here;
    stretch->at(T(seen_s) + unknowns[0], w, t);
    const Eigen::Matrix<T, 3, 1> point = on_board.template cast<T>();
    ceres::AngleAxisRotatePoint(w.data(), point.data(), turned.data());
    const Eigen::Matrix<T, 3, 1> first = stretch->T_first_board.linear().template cast<T>() * turned +
                                         stretch->T_first_board.translation().template cast<T>() + t;
    ceres::AngleAxisRotatePoint(unknowns + 1, first.data(), here.data());
    here += Eigen::Map<const Eigen::Matrix<T, 3, 1>>(unknowns + 4);
    std::array<T, kLensNumbers> numbers;
    for (std::size_t i = 0; i < kLensNumbers; ++i) numbers[i] = T((*lens)[i]);
    Eigen::Matrix<T, 2, 1> projected;
    if (!project_through(pinhole, numbers.data(), here, projected)) return false;
    residual[0] = projected.x() - T(pixel.x());
    residual[1] = projected.y() - T(pixel.y());
    return true;
  }
};

class TimeFit {
 public:
  TimeFit(const capture::CameraModel& second, std::vector<Stretch> stretches, const std::vector<TimedView>& views,
          std::int64_t origin_ns)
      : pinhole_(second.kind == capture::CameraModel::Kind::pinhole),
        lens_(lens_numbers(second)),
        stretches_(std::move(stretches)) {
    for (const TimedView& view : views)
      if (!view.view.seen.empty()) views_.push_back({1e-9 * static_cast<double>(view.time_ns - origin_ns), &view.view});
  }

  /// The corners of a picture within a stretch of the trajectory.
  using Pair = std::vector<Cost>;
  /// Of all pictures that this offset puts within a stretch.
  std::vector<Pair> pairs(double offset_s) const {
    std::vector<Pair> pairs;
    for (const auto& [seen_s, view] : views_) {
      const double time_s = seen_s + offset_s;
      const auto after = std::upper_bound(stretches_.begin(), stretches_.end(), time_s,
                                          [](double t, const Stretch& s) { return t < s.from_s; });
      if (after == stretches_.begin() || time_s > std::prev(after)->to_s) continue;
      Pair& pair = pairs.emplace_back();
      for (const SeenPoints& seen : view->seen)
        for (std::size_t i = 0; i < seen.pixels.size(); ++i)
          pair.push_back({pinhole_, &lens_, &*std::prev(after), seen_s - std::prev(after)->from_s, seen.points_m[i],
                          seen.pixels[i]});
    }
    return pairs;
  }

  /// Mean over pictures of their corners' distances, limited to max_error_px; infinite without pairs.
  static double misfit_px(const std::vector<Pair>& pairs, const std::array<double, kUnknowns>& x) {
    double sum = 0;
    for (const Pair& pair : pairs) {
      double of_picture = 0;
      for (const Cost& cost : pair) {
        Vector2d error;
        of_picture += cost(x.data(), error.data()) ? std::min(kTime.max_error_px, error.norm()) : kTime.max_error_px;
      }
      sum += of_picture / static_cast<double>(pair.size());
    }
    return pairs.empty() ? std::numeric_limits<double>::infinity() : sum / static_cast<double>(pairs.size());
  }

  static bool refine(const std::vector<Pair>& pairs, std::array<double, kUnknowns>& x) {
    ceres::Problem problem;
    for (const Pair& pair : pairs)
      for (const Cost& cost : pair)
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Cost, 2, kUnknowns>(new Cost(cost)),
                                 new ceres::HuberLoss(kTime.huber_px), x.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = kTime.iterations;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    return summary.IsSolutionUsable();
  }

 private:
  bool pinhole_;
  LensNumbers lens_;
  std::vector<Stretch> stretches_;
  std::vector<std::pair<double, const BoardView*>> views_;
};

/// 1σ of the offset, and the board's speed. The corners of a picture share the trajectory's error; pictures are
/// independent, so the covariance is cluster-robust (Liang & Zeger 1986).
void find_sigma(const std::vector<TimeFit::Pair>& pairs, const std::array<double, kUnknowns>& x,
                TimeOffsetCalibration& result) {
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  Matrix bread = Matrix::Zero(), meat = Matrix::Zero();
  std::vector<double> errors;
  double speed = 0, corners = 0;
  for (const TimeFit::Pair& pair : pairs) {
    Eigen::Matrix<double, kUnknowns, 1> pull = Eigen::Matrix<double, kUnknowns, 1>::Zero();
    for (const Cost& cost : pair) {
      const ceres::AutoDiffCostFunction<Cost, 2, kUnknowns> function(new Cost(cost));
      Vector2d error;
      Eigen::Matrix<double, 2, kUnknowns, Eigen::RowMajor> j;
      const double* parameters[] = {x.data()};
      double* jacobians[] = {j.data()};
      if (!function.Evaluate(parameters, error.data(), jacobians)) continue;
      const double weight = std::min(1.0, kTime.huber_px / std::max(error.norm(), 1e-12));
      bread += weight * j.transpose() * j;
      pull += weight * j.transpose() * error;
      errors.push_back(error.norm());
      speed += j.col(0).norm();
      corners += 1;
    }
    meat += pull * pull.transpose();
  }
  result.median_px = median(errors);
  result.speed_px = speed / corners;
  const double count = static_cast<double>(pairs.size());
  const Matrix inverse = bread.ldlt().solve(Matrix::Identity());
  const Matrix covariance = inverse * meat * inverse * (count / std::max(1.0, count - kUnknowns));
  result.sigma_s = std::hypot(std::sqrt(covariance(0, 0)), kTime.cubic_sigma_s);
}

}  // namespace

TimeOffsetCalibration calibrate_time(const capture::CameraModel& first, const capture::CameraModel& second,
                                     const Isometry3d& T_second_first, const std::vector<TimedView>& first_views,
                                     const std::vector<TimedView>& second_views) {
  TimeOffsetCalibration result;
  if (first_views.empty() || second_views.empty()) {
    result.refusal = rejection_reason(result);
    return result;
  }
  const std::int64_t origin_ns = first_views.front().time_ns;
  std::vector<TimedPose> path;
  for (const TimedView& timed : first_views)
    if (const auto pose = refined_pose(timed.view, first))
      path.push_back({1e-9 * static_cast<double>(timed.time_ns - origin_ns), *pose});
  const TimeFit fit(second, stretches_of(path), second_views, origin_ns);

  const Vector3d w = rotation_vector(T_second_first.linear()), t = T_second_first.translation();
  std::array<double, kUnknowns> x{0, w.x(), w.y(), w.z(), t.x(), t.y(), t.z()};
  const std::array<double, kUnknowns> start = x;
  double min_px = std::numeric_limits<double>::infinity();
  const int steps = static_cast<int>(std::lround(kTime.max_search_s / kTime.search_s));
  for (int i = -steps; i <= steps; ++i) {
    std::array<double, kUnknowns> guess = start;
    guess[0] = i * kTime.search_s;
    const auto pairs = fit.pairs(guess[0]);
    const double px = static_cast<int>(pairs.size()) < kCalibration.min_moments
                          ? std::numeric_limits<double>::infinity()
                          : TimeFit::misfit_px(pairs, guess);
    if (px < min_px) {
      min_px = px;
      x = guess;
    }
  }
  // The offset changes which pictures lie within the trajectory.
  std::vector<TimeFit::Pair> pairs;
  for (int round = 0; round < kTime.rounds && std::isfinite(min_px); ++round) {
    pairs = fit.pairs(x[0]);
    if (static_cast<int>(pairs.size()) < kCalibration.min_moments || !TimeFit::refine(pairs, x)) break;
  }
  result.pictures = static_cast<int>(pairs.size());
  result.offset_s = x[0];
  if (result.pictures >= kCalibration.min_moments) find_sigma(pairs, x, result);
  result.refusal = rejection_reason(result);
  return result;
}

}  // namespace lumigraft::reconstruct
