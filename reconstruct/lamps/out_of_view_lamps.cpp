#include "reconstruct/lamps/out_of_view_lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::OutOfView& kOutOfView = kLampParameters.out_of_view;
/// Power that the uncertainty of weaker lamps is relative to, over all light at the probe.
const float kDim = kOutOfView.min_power * std::exp(static_cast<float>(kLampParameters.posterior.log_dim));

}  // namespace

OutOfViewLamps::OutOfViewLamps(Illumination& light, const FieldRays& rays) {
  all_light_ = light.environment_sh[0].mean() * std::sqrt(4 * std::numbers::pi_v<float>);
  for (const PointLight& lamp : light.lights)
    if (lamp.visibility == PointLight::Visibility::visible) all_light_ += lamp.irradiance.mean();
  const Eigen::Vector3f& probe = light.probe_position_m;
  std::erase_if(light.lights, [&](const PointLight& lamp) {
    if (lamp.visibility != PointLight::Visibility::dark) return false;
    const float free_m = (lamp.position_m - probe).norm() - 2 * lamp.radius_m - kOutOfView.housing_m;
    return free_m <= 0 || !rays.first_crossing(probe, lamp.direction, free_m);
  });
  for (PointLight& lamp : light.lights) {
    if (lamp.visibility == PointLight::Visibility::visible) continue;
    priors_.push_back({lamp.id, lamp.irradiance, lamp.power_log_sigma});
    lamp.irradiance = Eigen::Vector3f::Constant(std::max(kOutOfView.min_power * all_light_, 1e-9f));
    lamp.clipped = true;
  }
}

void OutOfViewLamps::resolve(Illumination& light, const std::vector<capture::TaggedLamp>& named,
                             std::vector<std::string>& warnings) const {
  for (const Prior& prior : priors_) {
    const auto lamp =
        std::find_if(light.lights.begin(), light.lights.end(), [&](const PointLight& l) { return l.id == prior.id; });
    if (lamp == light.lights.end()) continue;
    lamp->clipped = false;
    const auto name = static_cast<std::size_t>(lamp->lamp_tag);
    const std::string text = "lamp " + (name < named.size() ? named[name].name : "") + ": ";
    const float irradiance = lamp->irradiance.mean();
    const float upper_bound = irradiance + lamp->power_log_sigma * std::max(irradiance, kDim * all_light_);
    if (upper_bound < kOutOfView.off_power * all_light_) {
      light.lights.erase(lamp);
      continue;
    }
    lamp->visibility = PointLight::Visibility::outside_view;  // it shines, even if the fish-eye saw its place dark
    if (lamp->power_log_sigma <= kOutOfView.max_log_sigma) continue;
    if (prior.log_sigma >= kUnknownPowerLogSigma) {
      warnings.push_back(text +
                         "neither the fish-eye nor the shading determines its power, and none is configured: omitted");
      light.lights.erase(lamp);
      continue;
    }
    lamp->irradiance = prior.irradiance;
    lamp->power_log_sigma = prior.log_sigma;
    lamp->intensity = lamp->irradiance * (lamp->position_m - light.probe_position_m).squaredNorm();
  }
}

}  // namespace lumigraft::reconstruct
