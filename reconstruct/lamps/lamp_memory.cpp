#include "reconstruct/lamps/lamp_memory.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Memory& kMemory = kLampParameters.memory;

bool same_lamp(const PointLight& was, const PointLight& now) {
  return was.id == now.id && was.clipped == now.clipped && was.direction.dot(now.direction) > kMemory.same_direction &&
         (now.clipped || (was.irradiance - now.irradiance).norm() < kMemory.same_irradiance * was.irradiance.norm());
}

bool same_shape(const LampShape& a, const LampShape& b) {
  return a.flat == b.flat && a.beam == b.beam && a.far == b.far;
}

bool carried(const PointLight& was, const PointLight& now) {
  return was.id == now.id && was.direction.dot(now.direction) <= kMemory.same_direction;
}

/// 1σ of the log of a lamp's intensity that its being carried changes.
double carried_log_sigma(const PointLight& was, const PointLight& now) {
  const double turned = std::acos(std::clamp(was.direction.dot(now.direction), -1.0f, 1.0f));
  const double raised =
      std::asin(std::clamp(now.direction.z(), -1.0f, 1.0f)) - std::asin(std::clamp(was.direction.z(), -1.0f, 1.0f));
  return std::hypot(kMemory.flux_log_sigma, kMemory.raised_slope * raised, kMemory.turned_slope * turned);
}

/// Log of the intensity along the axis, mean of the channels: E d² / cos(tilt)ᵐ with exponent m of the emission.
double log_intensity(const PointLight& light, const LampShape& shape) {
  double sum = 0;
  for (Eigen::Index c = 0; c < 3; ++c)
    sum += std::log(std::max(light.irradiance[c], 1e-12f)) + shape.log_gain[static_cast<std::size_t>(c)];
  const double tilt = Eigen::Vector2d::Map(shape.tilt.data()).squaredNorm();
  return sum / 3 - 2 * std::log(shape.inverse_distance) + 0.5 * shape.emission_exponent() * std::log1p(tilt);
}
/// Its derivatives by the lamp's unknowns.
Eigen::RowVectorXd intensity_slope(const PointLight& light, const LampShape& shape) {
  Eigen::RowVectorXd slope(kUnknownsPerLamp);
  const auto tilt = Eigen::RowVector2d::Map(shape.tilt.data());
  slope << -2 / shape.inverse_distance, shape.emission_exponent() / (1 + tilt.squaredNorm()) * tilt,
      Eigen::RowVector3d::Constant(light.clipped ? 1 / 3.0 : 0);  // else no unknown
  return slope;
}

bool same_place(const KeptLamp& kept, const Eigen::Vector3f& probe_m, const PointLight& light) {
  const Eigen::Vector3f way = kept.position_m - probe_m;
  const float angular_radius_rad = std::atan(kept.radius_m / way.norm());
  return way.normalized().dot(light.direction) > kMemory.same_direction &&
         std::abs(light.angular_radius_rad - angular_radius_rad) < kMemory.same_size * angular_radius_rad;
}

}  // namespace

const KeptLamp* LampMemory::kept_at(const Eigen::Vector3f& probe_m, const PointLight& light) const {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const KeptLamp& kept) { return same_place(kept, probe_m, light); });
  return found == kept_.end() ? nullptr : &*found;
}

std::optional<LampPrior> LampMemory::prior(const ShadingModel& model, const std::vector<LampShape>& shapes) const {
  const auto size = static_cast<Eigen::Index>(kUnknownsPerLamp * shapes.size());
  LampPrior prior{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size)};
  std::vector<Eigen::Index> from, to;
  bool any = false;
  for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
    const PointLight& light = model.light(lamp);
    const LampShape& shape = shapes[lamp];
    const auto was = std::find_if(lamps_.begin(), lamps_.end(), [&](const Lamp& l) {
      return same_shape(l.shape, shape) && (same_lamp(l.light, light) || carried(l.light, light));
    });
    const auto at = static_cast<Eigen::Index>(kUnknownsPerLamp * lamp);
    if (was == lamps_.end()) {
      any |= add_kept(model, light, shape, at, prior);
      continue;
    }
    const Eigen::Index of = kUnknownsPerLamp * (was - lamps_.begin());
    if (carried(was->light, light)) {
      if (shape.far || model.placed(lamp)) continue;
      add_intensity(light, shape, *was, of, at, prior);
      any = true;
      continue;
    }
    prior.mean[at] = was->shape.inverse_distance;
    if (shape.flat) prior.mean.segment<2>(at + 1) = Eigen::Vector2d::Map(model.tilt_of(lamp, was->normal).data());
    for (Eigen::Index c = 0; c < 3; ++c)  // the power is remembered; what clipping left of it may differ
      prior.mean[at + 3 + c] =
          was->shape.log_gain[static_cast<std::size_t>(c)] +
          std::log(std::max(was->light.irradiance[c], 1e-12f) / std::max(light.irradiance[c], 1e-12f));
    for (Eigen::Index i = 0; i < kUnknownsPerLamp; ++i) {
      to.push_back(at + i);
      from.push_back(of + i);
    }
  }
  if (from.empty() && !any) return std::nullopt;
  if (!from.empty()) prior.information(to, to) = kMemory.kept * covariance_(from, from).inverse();
  return prior;
}

bool LampMemory::add_kept(const ShadingModel& model, const PointLight& light, const LampShape& shape, Eigen::Index at,
                          LampPrior& prior) const {
  const KeptLamp* kept = kept_at(model.probe_m(), light);
  if (!kept || shape.far || kept->flat != shape.flat || kept->beam != shape.beam) return false;
  prior.mean[at] = 1 / static_cast<double>((kept->position_m - model.probe_m()).norm());
  const double sigma = prior.mean[at] * std::hypot(double{kept->distance_log_sigma}, double{kMemory.kept_log_sigma});
  prior.information(at, at) = 1 / (sigma * sigma);
  return true;
}

/// The intensity of a lamp that was carried, linearized at the distance that it implies.
void LampMemory::add_intensity(const PointLight& light, LampShape shape, const Lamp& was, Eigen::Index of,
                               Eigen::Index at, LampPrior& prior) const {
  shape.inverse_distance = std::max(shape.inverse_distance, 1e-3);
  const double then = log_intensity(was.light, was.shape);
  shape.inverse_distance *= std::exp((log_intensity(light, shape) - then) / 2);
  const Eigen::RowVectorXd slope_then = intensity_slope(was.light, was.shape);
  const double variance_then =
      slope_then * covariance_.block<kUnknownsPerLamp, kUnknownsPerLamp>(of, of) * slope_then.transpose();
  LinearRows row(prior.mean.size());
  Eigen::RowVectorXd slope = row.zero();
  slope.segment<kUnknownsPerLamp>(at) = intensity_slope(light, shape);
  Eigen::VectorXd unknowns = Eigen::VectorXd::Zero(kUnknownsPerLamp);
  unknowns << shape.inverse_distance, shape.tilt[0], shape.tilt[1], shape.log_gain[0], shape.log_gain[1],
      shape.log_gain[2];
  row.add(slope, slope.segment<kUnknownsPerLamp>(at) * unknowns,
          std::hypot(carried_log_sigma(was.light, light), std::sqrt(std::max(variance_then, 0.0) / kMemory.kept)));
  prior.intensities.push_back(std::move(row));
}

void LampMemory::keep(const ShadingModel& model, const LampPosterior& posterior) {
  lamps_.clear();
  for (std::size_t lamp = 0; lamp < posterior.shapes.size(); ++lamp)
    lamps_.push_back({model.light(lamp), posterior.shapes[lamp], model.normal(lamp, posterior.shapes[lamp])});
  // From here on the posterior has what these say.
  std::erase_if(kept_, [&](const KeptLamp& kept) {
    return std::any_of(lamps_.begin(), lamps_.end(),
                       [&](const Lamp& lamp) { return same_place(kept, model.probe_m(), lamp.light); });
  });
  misfit_ = posterior.misfit;
  covariance_ = posterior.with_prior.inverse();
}

}  // namespace lumigraft::reconstruct
