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
  bool any_kept = false;
  for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
    const PointLight& light = model.light(lamp);
    const LampShape& shape = shapes[lamp];
    const auto was = std::find_if(lamps_.begin(), lamps_.end(), [&](const Lamp& l) {
      return same_lamp(l.light, light) && l.shape.flat == shape.flat && l.shape.beam == shape.beam &&
             l.shape.far == shape.far;
    });
    const auto at = static_cast<Eigen::Index>(kUnknownsPerLamp * lamp);
    if (was == lamps_.end()) {
      const KeptLamp* kept = kept_at(model.probe_m(), light);
      if (!kept || shape.far || kept->flat != shape.flat || kept->beam != shape.beam) continue;
      prior.mean[at] = 1 / static_cast<double>((kept->position_m - model.probe_m()).norm());
      const double sigma =
          prior.mean[at] * std::hypot(double{kept->distance_log_sigma}, double{kMemory.kept_log_sigma});
      prior.information(at, at) = 1 / (sigma * sigma);
      any_kept = true;
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
      from.push_back(kUnknownsPerLamp * (was - lamps_.begin()) + i);
    }
  }
  if (from.empty() && !any_kept) return std::nullopt;
  if (!from.empty()) prior.information(to, to) = kMemory.kept * covariance_(from, from).inverse();
  return prior;
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
