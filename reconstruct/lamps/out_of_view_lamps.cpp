#include "reconstruct/lamps/out_of_view_lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/lamps/lamp_refinement.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kLeast = 1e-3f;  ///< of all light at the probe: power is looked for from here on
const float kDim = kLeast * std::exp(static_cast<float>(kLogDim));  ///< what a power's uncertainty is of, at least
constexpr float kOff = 0.05f;       ///< a lamp that surely gives no more than this is off: what shading tells of light
constexpr float kTold = 0.3f;       ///< 1σ of log power, beyond which a power that was said before is better
constexpr float kBeside_m = 0.05f;  ///< what is so near to a lamp is its own shade

}  // namespace

OutOfViewLamps::OutOfViewLamps(Illumination& light, const FieldRays& rays) {
  all_light_ = light.environment_sh[0].mean() * std::sqrt(4 * std::numbers::pi_v<float>);
  for (const PointLight& lamp : light.lights)
    if (lamp.shown == PointLight::Shown::yes) all_light_ += lamp.irradiance.mean();
  const Eigen::Vector3f& probe = light.probe_position_m;
  std::erase_if(light.lights, [&](const PointLight& lamp) {
    if (lamp.shown != PointLight::Shown::dark) return false;
    const float free_m = (lamp.position_m - probe).norm() - 2 * lamp.radius_m - kBeside_m;
    return free_m <= 0 || !rays.first_crossing(probe, lamp.direction, free_m);
  });
  for (PointLight& lamp : light.lights) {
    if (lamp.shown == PointLight::Shown::yes) continue;
    said_.push_back({lamp.id, lamp.irradiance, lamp.power_log_sigma});
    lamp.irradiance = Eigen::Vector3f::Constant(std::max(kLeast * all_light_, 1e-9f));
    lamp.clipped = true;
  }
}

void OutOfViewLamps::settle(Illumination& light, const std::vector<capture::TaggedLamp>& named,
                            std::vector<std::string>& warnings) const {
  for (const Said& said : said_) {
    const auto lamp =
        std::find_if(light.lights.begin(), light.lights.end(), [&](const PointLight& l) { return l.id == said.id; });
    if (lamp == light.lights.end()) continue;
    lamp->clipped = false;
    const auto name = static_cast<std::size_t>(lamp->mark);
    const std::string text = "lamp " + (name < named.size() ? named[name].name : "") + ": ";
    const float irradiance = lamp->irradiance.mean();
    const float at_most = irradiance + lamp->power_log_sigma * std::max(irradiance, kDim * all_light_);
    if (at_most < kOff * all_light_) {
      light.lights.erase(lamp);
      continue;
    }
    if (lamp->power_log_sigma <= kTold) continue;
    if (said.log_sigma >= kUnknownPower) {
      warnings.push_back(text +
                         "neither the fish-eye nor the shading tells its power, and none is configured: left out");
      light.lights.erase(lamp);
      continue;
    }
    lamp->irradiance = said.irradiance;
    lamp->power_log_sigma = said.log_sigma;
    lamp->intensity = lamp->irradiance * (lamp->position_m - light.probe_position_m).squaredNorm();
  }
}

}  // namespace lumigraft::reconstruct
