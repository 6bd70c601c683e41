#include "reconstruct/albedo/kept_albedo.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/light/fluence.h"

namespace lumigraft::reconstruct {
namespace {

/// `solved` itself if it knows all that `kept` does.
std::shared_ptr<const AlbedoBrick> with_unknown_from(const std::shared_ptr<const AlbedoBrick>& solved,
                                                     const AlbedoBrick& kept) {
  std::shared_ptr<AlbedoBrick> result;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (!(solved->sigma[i] < 0 && kept.sigma[i] >= 0)) continue;
    if (!result) result = std::make_shared<AlbedoBrick>(*solved);
    result->albedo[i] = kept.albedo[i];
    result->sigma[i] = kept.sigma[i];
  }
  return result ? result : solved;
}

}  // namespace

float common_error(const Illumination& light) {
  float power_error = 0;  // W/m² at the probe
  for (const PointLight& lamp : light.lights) power_error += lamp.power_log_sigma * lamp.irradiance.mean() / 4;
  const float all_light = mean_irradiance(light, light.probe_position_m).mean();
  return std::hypot(kAlbedoParameters.lighting.lamp_error, power_error / std::max(all_light, 1e-9f));
}

float sigma_later(const SampleAlbedo& solved, float common_error) {
  return std::hypot(solved.sigma, common_error * solved.albedo.mean()) /
         std::sqrt(kAlbedoParameters.stage.kept_information);
}

std::shared_ptr<const AlbedoField> KeptAlbedo::complete(const std::shared_ptr<const AlbedoField>& solved) {
  if (!solved) return kept_;
  auto result = std::make_shared<AlbedoField>(*solved);
  for (const auto& [key, kept] : kept_->bricks) {
    const auto own = solved->bricks.find(key);
    if (own == solved->bricks.end()) {
      result->bricks[key] = kept;
      continue;
    }
    Completed& last = completed_[key];
    if (last.solved != own->second) last = {own->second, with_unknown_from(own->second, *kept)};
    if (last.result != own->second) result->bricks[key] = last.result;
  }
  return result;
}

}  // namespace lumigraft::reconstruct
