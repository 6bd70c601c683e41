#include "reconstruct/lamps/lamp_prior_rows.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Posterior& kPrior = kLampParameters.posterior;

double log_irradiance(const PointLight& light, int channel) {
  return std::log(std::max(light.irradiance[channel], 1e-12f));
}

/// Visible clipped lamps, of any kind and of each.
struct ClippedKinds {
  std::vector<std::size_t> all, flat, round;

  ClippedKinds(const ShadingModel& model, const std::vector<LampShape>& shapes) {
    for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp) {
      const PointLight& light = model.light(lamp);
      if (!light.clipped || light.visibility != PointLight::Visibility::visible) continue;
      all.push_back(lamp);
      (shapes[lamp].flat ? flat : round).push_back(lamp);
    }
  }
};

}  // namespace

double usual_inverse_distance(const PointLight& light) {
  return kPrior.inverse_height * std::max(0.0f, light.direction.z());
}

void add_wide_rows(const ShadingModel& model, LinearRows& rows) {
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp) {
    const PointLight& light = model.light(lamp);
    const Eigen::Index at = first_of(lamp);
    const auto unit = [&](Eigen::Index unknown) {
      Eigen::RowVectorXd row = rows.zero();
      row[at + unknown] = 1;
      return row;
    };
    rows.add(unit(0), usual_inverse_distance(light), kPrior.inverse_distance_sigma);
    rows.add(unit(1), 0, kPrior.tilt_sigma);
    rows.add(unit(2), 0, kPrior.tilt_sigma);
    const Eigen::Vector3d measured(log_irradiance(light, 0), log_irradiance(light, 1), log_irradiance(light, 2));
    const Eigen::Vector3d level = Eigen::Vector3d::Constant(1 / 3.0),
                          warm(kPrior.warm[0], kPrior.warm[1], kPrior.warm[2]);
    const auto colour = [&](const Eigen::Vector3d& weights) {
      Eigen::RowVectorXd row = rows.zero();
      row.segment<3>(at + 3) = weights.transpose();
      return row;
    };
    rows.add(colour(level), 0, kPrior.gain_log_sigma);
    rows.add(colour(warm), kPrior.usual_warmth - warm.dot(measured), kPrior.warmth_sigma);
    const Eigen::Vector3d across = level.cross(warm).normalized();  // neither level nor warmth
    rows.add(colour(across), -across.dot(measured), kPrior.hue_sigma);
  }
}

void add_alike_rows(const ShadingModel& model, const std::vector<LampShape>& shapes, LinearRows& rows) {
  const auto log_radiance = [&](std::size_t lamp, int channel) {
    const PointLight& light = model.light(lamp);
    return log_irradiance(light, channel) - 2 * std::log(static_cast<double>(light.angular_radius_rad));
  };
  const ClippedKinds kinds(model, shapes);
  for (const auto& [kind, sigma] :
       {std::pair(kinds.flat, kPrior.alike_log_sigma), std::pair(kinds.round, kPrior.alike_log_sigma),
        std::pair(kinds.all, kPrior.any_log_sigma)}) {
    const double part = 1 / static_cast<double>(kind.size());
    for (int c = 0; c < 3; ++c) {
      double mean = 0;
      for (const std::size_t lamp : kind) mean += part * log_radiance(lamp, c);
      for (const std::size_t lamp : kind) {  // its log radiance, less the mean of the kind
        Eigen::RowVectorXd row = rows.zero();
        for (const std::size_t other : kind) row[first_of(other) + 3 + c] -= part;
        row[first_of(lamp) + 3 + c] += 1;
        rows.add(row, mean - log_radiance(lamp, c), sigma);
      }
    }
  }
}

std::vector<LinearRows> height_rows(const ShadingModel& model, const std::vector<LampShape>& shapes) {
  std::vector<LinearRows> result;
  const auto add = [&](const Eigen::RowVectorXd& row, double value, double scale) {
    result.emplace_back(row.size());
    result.back().add(row, value, scale);
  };
  const auto size = static_cast<Eigen::Index>(kUnknownsPerLamp * model.lamps());
  const auto inverse_distance = [&](std::size_t lamp) { return Eigen::RowVectorXd::Unit(size, first_of(lamp)); };
  for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp)
    add(inverse_distance(lamp), usual_inverse_distance(model.light(lamp)), kPrior.inverse_height_scale);
  const ClippedKinds kinds(model, shapes);
  for (const std::vector<std::size_t>& kind : {kinds.flat, kinds.round}) {
    // Least squares of w = ω_z / height.
    Eigen::RowVectorXd inverse_height = Eigen::RowVectorXd::Zero(size);
    double squares = 1e-9;
    for (const std::size_t lamp : kind) {
      const double up = std::max(0.0f, model.light(lamp).direction.z());
      inverse_height += up * inverse_distance(lamp);
      squares += up * up;
    }
    inverse_height /= squares;
    for (const std::size_t lamp : kind)
      if (const double up = model.light(lamp).direction.z(); up > 0 && kind.size() > 1)
        add(inverse_distance(lamp) - up * inverse_height, 0, kPrior.alike_inverse_height);
  }
  return result;
}

LinearRows prior_rows(const LampPrior& prior) {
  LinearRows rows(prior.mean.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(prior.information);
  rows.a = eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
  rows.b = rows.a * prior.mean;
  return rows;
}

}  // namespace lumigraft::reconstruct
