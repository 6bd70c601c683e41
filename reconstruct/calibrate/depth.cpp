#include "reconstruct/calibrate/depth.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/calibrate/acceptance.h"
#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Row = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

constexpr auto& kDepthFit = kCalibration.depth;

struct Point {
  Vector3d depth_m;  ///< in the depth camera's frame
  std::size_t view;
  double distance_m, weight;
};

class DepthFit {
 public:
  DepthFit(const capture::CameraModel& depth, const Board& board, const std::vector<BoardDepthView>& views)
      : depth_(depth), half_(0.5 * kDepthFit.used_edge * board.extent_m()), views_(views) {
    for (int v = 0; v < depth.height; ++v)
      for (int u = 0; u < depth.width; ++u) {
        const auto ray = depth.unproject({u, v});
        rays_.push_back(ray && ray->z() > 0 ? Vector3d(*ray / ray->z()) : Vector3d::Zero());
      }
  }

  /// The depth points within `gate_m` of a board, subsampled per view.
  std::vector<Point> points(const Isometry3d& T_color_depth, double gate_m) const {
    std::vector<Point> all;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Isometry3d T_board_depth = views_[i].T_color_board.inverse() * T_color_depth;
      std::vector<Point> here;
      const PixelRegion region = around(T_board_depth.inverse(), gate_m);
      for (int at = 0; at < region.width * region.height; ++at) {
        const std::size_t pixel = static_cast<std::size_t>(region.top + at / region.width) * depth_.width +
                                  static_cast<std::size_t>(region.left + at % region.width);
        const float z = views_[i].depth_m->data[pixel];
        if (!(z > 0)) continue;
        const Vector3d point = z * rays_[pixel], on_board = T_board_depth * point;
        if (std::abs(on_board.x()) > half_.x() || std::abs(on_board.y()) > half_.y() || std::abs(on_board.z()) > gate_m)
          continue;
        here.push_back({point, i, on_board.z(), 1 / std::pow(kDepthFit.noise_per_m * z * z, 2)});
      }
      if (here.size() < kDepthFit.min_view_px) continue;
      const double step = std::max(1.0, static_cast<double>(here.size()) / kDepthFit.max_view_px);
      for (double at = 0; at < static_cast<double>(here.size()); at += step)
        all.push_back(here[static_cast<std::size_t>(at)]);
    }
    return all;
  }

  /// Derivative of the point's distance from its board by a left perturbation of T_color_depth: rotation, then
  /// translation.
  Row slope(const Point& point, const Isometry3d& T_color_depth) const {
    const Vector3d normal = views_[point.view].T_color_board.linear().col(2);
    Row j;
    j << (T_color_depth * point.depth_m).cross(normal), normal;
    return j;
  }

 private:
  /// Image region of the board and of the space within `gate_m` of its plane; the whole picture where it cannot be
  /// determined.
  PixelRegion around(const Isometry3d& T_depth_board, double gate_m) const {
    Eigen::AlignedBox2d box;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d p(corner & 1 ? half_.x() : -half_.x(), corner & 2 ? half_.y() : -half_.y(),
                       corner & 4 ? gate_m : -gate_m);
      const Vector3d there = T_depth_board * p;
      const auto pixel = there.z() > kDepthFit.min_z_m ? depth_.project(there) : std::nullopt;
      if (!pixel) return {0, 0, depth_.width, depth_.height};
      box.extend(*pixel);
    }
    return region_around(box.min(), box.max(), depth_.width, depth_.height);
  }

  capture::CameraModel depth_;
  Eigen::Vector2d half_;
  const std::vector<BoardDepthView>& views_;
  std::vector<Vector3d> rays_;
};

double median_distance_m(const std::vector<Point>& points) {
  std::vector<double> distances;
  for (const Point& point : points) distances.push_back(std::abs(point.distance_m));
  return median(distances);
}

struct NormalEquations {
  Square jtj = Square::Zero();
  Row jtr = Row::Zero();
  std::vector<Row> by_view;  ///< Jᵀr per view
};

/// Normal equations with Huber weights; `limit` is a multiple of the noise.
NormalEquations normal_equations(const DepthFit& fit, const std::vector<Point>& points, const Isometry3d& T_color_depth,
                                 double limit, std::size_t views) {
  NormalEquations n;
  n.by_view.assign(views, Row::Zero());
  for (const Point& point : points) {
    const double whitened = std::abs(point.distance_m) * std::sqrt(point.weight);
    const double weight = point.weight * std::min(1.0, limit / std::max(whitened, 1e-12));
    const Row j = fit.slope(point, T_color_depth);
    n.jtj += weight * j * j.transpose();
    n.by_view[point.view] += weight * point.distance_m * j;
  }
  for (const Row& view : n.by_view) n.jtr += view;
  return n;
}

/// Whether the boards determine all six parameters: parallel boards leave three undetermined.
bool well_posed(const Square& jtj) {
  Row size;  // scales rotations to the translations that they cause
  size << Vector3d::Constant(std::sqrt(jtj.diagonal().head<3>().sum() / 3)),
      Vector3d::Constant(std::sqrt(jtj.diagonal().tail<3>().sum() / 3));
  const Square scaled = size.cwiseInverse().asDiagonal() * jtj * size.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[0] > kDepthFit.min_tilt_rad2 * solver.eigenvalues()[5];
}

int views_in(const std::vector<Point>& points) {
  int views = 0;
  for (std::size_t i = 0; i < points.size(); ++i) views += i == 0 || points[i].view != points[i - 1].view;
  return views;
}

}  // namespace

DepthCalibration calibrate_depth(const capture::CameraModel& depth, const Isometry3d& start, const Board& board,
                                 const std::vector<BoardDepthView>& views) {
  DepthCalibration result;
  result.T_color_depth = start;
  const DepthFit fit(depth, board, views);
  double gate_m = kDepthFit.first_gate_m, limit = kDepthFit.huber_sigmas;
  std::vector<Point> points;
  NormalEquations normal;
  for (int round = 0; round < kDepthFit.max_rounds; ++round) {
    points = fit.points(result.T_color_depth, gate_m);
    result.views = views_in(points);
    if (result.views < kCalibration.min_views) break;
    std::vector<double> whitened;
    for (const Point& point : points) whitened.push_back(std::abs(point.distance_m) * std::sqrt(point.weight));
    limit = kDepthFit.huber_sigmas * median(whitened) / 0.6745;
    normal = normal_equations(fit, points, result.T_color_depth, limit, views.size());
    if (!well_posed(normal.jtj)) break;
    const Row step = solved(normal.jtj, -normal.jtr);
    result.T_color_depth = isometry(rotation_by(step.head<3>()), step.tail<3>()) * result.T_color_depth;
    gate_m = std::clamp(kDepthFit.gate_medians * median_distance_m(points), kDepthFit.min_gate_m, gate_m);
    if (step.norm() < kDepthFit.settled) break;
  }
  if (result.views >= kCalibration.min_views) result.median_m = median_distance_m(points);
  if (result.views >= kCalibration.min_views && !well_posed(normal.jtj)) {
    result.turn_sigma_rad.setConstant(std::numbers::pi);
    result.shift_sigma_m.setConstant(10);
  } else if (result.views >= kCalibration.min_views) {
    // Errors of neighbouring pixels are correlated, and all points of a board share the error of its pose. Views are
    // independent, so the covariance is cluster-robust (Liang & Zeger 1986).
    const Square inverse = information_of(normal.jtj);
    Square meat = Square::Zero();
    for (const Row& view : normal.by_view) meat += view * view.transpose();
    const Square covariance = inverse * meat * inverse * (result.views / std::max(1.0, result.views - 6.0));
    result.turn_sigma_rad = covariance.diagonal().head<3>().cwiseSqrt();
    result.shift_sigma_m = covariance.diagonal().tail<3>().cwiseSqrt();
  }
  result.refusal = rejection_reason(result);
  return result;
}

}  // namespace lumigraft::reconstruct
