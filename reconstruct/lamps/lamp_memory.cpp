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

}  // namespace

std::optional<LampPrior> LampMemory::prior(const ShadingModel& model, const std::vector<LampShape>& shapes) const {
  const auto size = static_cast<Eigen::Index>(kUnknownsPerLamp * shapes.size());
  LampPrior prior{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size)};
  std::vector<Eigen::Index> from, to;
  for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
    const PointLight& light = model.light(lamp);
    const LampShape& shape = shapes[lamp];
    const auto was = std::find_if(lamps_.begin(), lamps_.end(), [&](const Lamp& l) {
      return same_lamp(l.light, light) && l.shape.flat == shape.flat && l.shape.beam == shape.beam &&
             l.shape.far == shape.far;
    });
    if (was == lamps_.end()) continue;
    const auto at = static_cast<Eigen::Index>(kUnknownsPerLamp * lamp);
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
  if (from.empty()) return std::nullopt;
  prior.information(to, to) = kMemory.kept * covariance_(from, from).inverse();
  return prior;
}

void LampMemory::keep(const ShadingModel& model, const LampPosterior& posterior) {
  lamps_.clear();
  for (std::size_t lamp = 0; lamp < posterior.shapes.size(); ++lamp)
    lamps_.push_back({model.light(lamp), posterior.shapes[lamp], model.normal(lamp, posterior.shapes[lamp])});
  misfit_ = posterior.misfit;
  covariance_ = posterior.with_prior.inverse();
}

}  // namespace lumigraft::reconstruct
