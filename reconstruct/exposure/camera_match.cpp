#include "reconstruct/exposure/camera_match.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>

#include "reconstruct/exposure/parameters.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

constexpr const ExposureParameters::Match& kMatch = kExposure.match;

/// The nearest surface in every direction from a point.
class NearestSurface {
 public:
  NearestSurface(const std::vector<Vector3f>& surface_m, const Vector3f& from_m) : from_m_(from_m) {
    for (const Vector3f& point_m : surface_m) {
      const Vector3f ray = point_m - from_m;
      float& nearest = nearest_m_.try_emplace(cell_of(ray), std::numeric_limits<float>::infinity()).first->second;
      nearest = std::min(nearest, ray.norm());
    }
  }

  bool hides(const Vector3f& point_m) const {
    const Vector3f ray = point_m - from_m_;
    const BrickKey cell = cell_of(ray);
    for (int i = 0; i < 27; ++i) {
      const auto found = nearest_m_.find({cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 - 1});
      if (found != nearest_m_.end() && ray.norm() > kMatch.max_behind * found->second + kMatch.max_behind_m)
        return true;
    }
    return false;
  }

 private:
  static BrickKey cell_of(const Vector3f& ray) {
    const Eigen::Vector3i cell = (ray.normalized() / kMatch.direction_rad).array().floor().cast<int>();
    return {cell.x(), cell.y(), cell.z()};
  }

  Vector3f from_m_;
  std::unordered_map<BrickKey, float, BrickKeyHash> nearest_m_;
};

/// Whether a cell of the environment was measured.
bool measured(const EnvironmentMap& environment, const Vector3f& direction) {
  const int width = environment.radiance.width, height = environment.radiance.height;
  const float phi = std::atan2(direction.y(), direction.x()), theta = std::acos(std::clamp(direction.z(), -1.f, 1.f));
  constexpr float pi = std::numbers::pi_v<float>;
  const int u = std::clamp(static_cast<int>((phi + pi) / (2 * pi) * static_cast<float>(width)), 0, width - 1);
  const int v = std::clamp(static_cast<int>(theta / pi * static_cast<float>(height)), 0, height - 1);
  return (environment.seen.empty() || environment.seen.at(u, v) != 0) &&
         (environment.clipped.empty() || environment.clipped.at(u, v) == 0);
}

/// Radiance that the fish-eye measures in a direction; empty near lamps, at its limits and where radiance is not even,
/// as a cell of the environment is wider than a place.
std::optional<Array3f> fisheye_radiance(const Illumination& light, const Vector3f& direction) {
  for (const PointLight& lamp : light.lights)
    if (angle_between(direction, lamp.direction) < 1.5f * lamp.angular_radius_rad + kMatch.lamp_margin_rad)
      return std::nullopt;
  const Array3f centre = light.environment.sample(direction);
  const Vector3f s = direction.unitOrthogonal(), t = direction.cross(s);
  for (const Vector3f& side : {Vector3f(direction), s, t, Vector3f(-s), Vector3f(-t)}) {
    const Vector3f beside = (direction + kMatch.direction_rad * side).normalized();
    const float change = light.environment.sample(beside).mean() / centre.mean();
    if (!measured(light.environment, beside) || !(std::abs(std::log(change)) < kMatch.max_unevenness))
      return std::nullopt;
  }
  return (centre > 0).all() ? std::optional(centre) : std::nullopt;
}

struct Row {
  Array3f log_ratio;
  float corner;
};

std::vector<Row> rows_of(const std::vector<ColorPlace>& places, const std::vector<Vector3f>& surface_m,
                         const Illumination& light) {
  std::vector<Row> rows;
  const NearestSurface nearest(surface_m, light.probe_position_m);
  for (const ColorPlace& place : places) {
    const Vector3f ray = place.position_m - light.probe_position_m;
    if (ray.norm() < kMatch.min_distance_m || !(place.normal.dot(ray) < 0)) continue;
    const auto radiance = fisheye_radiance(light, ray.normalized());
    if (!radiance || nearest.hides(place.position_m)) continue;
    rows.push_back({(place.radiance / *radiance).log(), place.corner});
  }
  return rows;
}

constexpr int kUnknowns = 5;  // log gain of three channels, k₁, k₂
using Unknowns = Eigen::Vector<float, kUnknowns>;
using Information = Eigen::Matrix<float, kUnknowns, kUnknowns>;

struct Fit {
  Unknowns x = Unknowns::Zero();
  Information information = Information::Zero();
  float cost = 0;
  float inliers = 0;  ///< fraction of the rows
};

Array3f residual(const Row& row, const Unknowns& x) {
  return row.log_ratio - x.head<3>().array() + (x[3] + x[4] * row.corner) * row.corner;
}

/// 1/σ² of the priors.
Unknowns prior_information(bool with_falloff) {
  const auto inverse_square = [](float sigma) { return 1 / (sigma * sigma); };
  Unknowns result = Unknowns::Constant(inverse_square(kMatch.gain_sigma));
  result[3] = with_falloff ? inverse_square(kMatch.falloff_sigma) : inverse_square(1e-3f);
  result[4] = with_falloff ? inverse_square(kMatch.falloff_bend_sigma) : inverse_square(1e-3f);
  return result;
}

Fit fit_from(float start_falloff, const std::vector<Row>& rows, bool with_falloff) {
  Fit fit;
  fit.x[3] = start_falloff;
  for (int c = 0; c < 3; ++c) {
    std::vector<float> logs;
    for (const Row& row : rows) logs.push_back(row.log_ratio[c] + start_falloff * row.corner);
    fit.x[c] = median(logs);
  }
  const Unknowns prior = prior_information(with_falloff);
  const float each = 1 / (kMatch.log_sigma * kMatch.log_sigma * kMatch.places_per_observation);
  float scale = kMatch.first_scale;
  for (int round = 0; round < kMatch.rounds; ++round) {
    scale = std::max(kMatch.log_sigma, kMatch.scale_step * scale);
    fit.information = prior.asDiagonal();
    Unknowns right = Unknowns::Zero();
    fit.cost = fit.inliers = 0;
    for (const Row& row : rows) {
      const float squared = residual(row, fit.x).square().mean(), s = scale * scale;
      const float weight = each * (s / (s + squared)) * (s / (s + squared));
      for (int c = 0; c < 3; ++c) {
        Unknowns slope = Unknowns::Zero();
        slope[c] = 1;
        slope[3] = -row.corner;
        slope[4] = -row.corner * row.corner;
        fit.information += weight * slope * slope.transpose();
        right += weight * row.log_ratio[c] * slope;
      }
      fit.cost += s * squared / (s + squared) * each;
      fit.inliers += squared < s ? 1 / static_cast<float>(rows.size()) : 0;
    }
    fit.cost += 0.5f * fit.x.dot(prior.asDiagonal() * fit.x);
    fit.x = fit.information.ldlt().solve(right);
  }
  return fit;
}

}  // namespace

std::optional<CameraMatch> match_cameras(const std::vector<ColorPlace>& places, const std::vector<Vector3f>& surface_m,
                                         const Illumination& light, bool with_falloff) {
  if (light.environment.radiance.empty()) return std::nullopt;
  const std::vector<Row> rows = rows_of(places, surface_m, light);
  if (rows.size() < kMatch.min_places) return std::nullopt;
  Fit best = fit_from(0, rows, with_falloff);
  // Where outliers are many, several falloffs are local minima.
  for (const float start : {0.3f, 0.6f}) {
    if (!with_falloff) break;
    const Fit other = fit_from(start, rows, true);
    if (other.cost < best.cost) best = other;
  }
  if (best.inliers < kMatch.min_inliers) return std::nullopt;
  std::vector<float> errors;
  for (const Row& row : rows) errors.push_back(std::sqrt(residual(row, best.x).square().mean()));
  const float sigma = std::max(kMatch.min_log_sigma, median(errors));
  const Information covariance = std::pow(sigma / kMatch.log_sigma, 2.0f) * best.information.inverse();
  CameraMatch match;
  match.log_gain = best.x.head<3>().array();
  match.level_sigma = std::sqrt(covariance.topLeftCorner<3, 3>().mean());
  match.hue_sigma = std::sqrt(
      std::max(0.0f, covariance.topLeftCorner<3, 3>().diagonal().mean() - covariance.topLeftCorner<3, 3>().mean()));
  if (with_falloff) {
    match.falloff = best.x.tail<2>().array();
    match.falloff_sigma = std::sqrt(covariance.bottomRightCorner<2, 2>().sum());
  }
  return match;
}

}  // namespace lumigraft::reconstruct
