#include "reconstruct/calibrate/depth_noise.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

constexpr double kMedianOfSigma = 0.6745;  // of the magnitude of a Gaussian

struct Reading {
  Eigen::Vector3d ray;  ///< z = 1
  double inverse_depth;
};

/// What depth measures on the inner part of the board.
std::vector<Reading> readings_on(const Board& board, const capture::CameraModel& depth, const BoardDepthView& view,
                                 const Eigen::Isometry3d& T_color_depth) {
  const Eigen::Isometry3d T_board_depth = view.T_color_board.inverse() * T_color_depth;
  const Eigen::Vector2d half = 0.5 * kCalibration.depth.used_edge * board.extent_m();
  std::vector<Reading> readings;
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const double z = static_cast<double>(view.depth_m->at(u, v));
      const auto direction = z > 0 ? depth.unproject({u, v}) : std::nullopt;
      if (!direction || !(direction->z() > 0)) continue;
      const Eigen::Vector3d ray = *direction / direction->z(), on_board = T_board_depth * (z * ray);
      if (std::abs(on_board.x()) > half.x() || std::abs(on_board.y()) > half.y() ||
          std::abs(on_board.z()) > kCalibration.depth.first_gate_m)
        continue;
      readings.push_back({ray, 1 / z});
    }
  return readings;
}

struct PlaneNoise {
  double sigma_m = 0, depth_m = 0, incidence_rad = 0;
};

/// Noise about the plane that fits best.
PlaneNoise noise_about_plane(const std::vector<Reading>& readings) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
  for (const Reading& reading : readings) {
    normal += reading.ray * reading.ray.transpose();
    right += reading.inverse_depth * reading.ray;
    middle += reading.ray / static_cast<double>(readings.size());
  }
  const Eigen::Vector3d plane = normal.ldlt().solve(right);
  std::vector<double> off;
  for (const Reading& reading : readings) off.push_back(std::abs(reading.inverse_depth - plane.dot(reading.ray)));
  PlaneNoise result;
  result.depth_m = 1 / plane.dot(middle);
  result.sigma_m = median(off) / kMedianOfSigma * result.depth_m * result.depth_m;
  result.incidence_rad = std::acos(std::min(1.0, std::abs(plane.normalized().dot(middle.normalized()))));
  return result;
}

}  // namespace

DepthNoiseCalibration measure_depth_noise(const capture::CameraModel& depth, capture::DepthPrinciple principle,
                                          const Eigen::Isometry3d& T_color_depth, const Board& board,
                                          const std::vector<BoardDepthView>& views) {
  const capture::DepthNoise usual = capture::usual_noise(principle);
  DepthNoiseCalibration result;
  std::vector<double> ratios;
  for (const BoardDepthView& view : views) {
    const std::vector<Reading> readings = readings_on(board, depth, view, T_color_depth);
    if (readings.size() < kCalibration.depth.min_view_px) continue;
    const PlaneNoise found = noise_about_plane(readings);
    ratios.push_back(found.sigma_m / usual.sigma_m(found.depth_m, found.incidence_rad));
    result.nearest_m = ratios.size() == 1 ? found.depth_m : std::min(result.nearest_m, found.depth_m);
    result.far_m = std::max(result.far_m, found.depth_m);
  }
  if (static_cast<int>(ratios.size()) < kCalibration.min_views) return {};
  result.views = static_cast<int>(ratios.size());
  result.scale = median(ratios);
  return result;
}

}  // namespace lumigraft::reconstruct
