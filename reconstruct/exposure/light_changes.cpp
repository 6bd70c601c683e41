#include "reconstruct/exposure/light_changes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruct/exposure/dimming.h"
#include "reconstruct/exposure/observed_shadows.h"
#include "reconstruct/exposure/parameters.h"
#include "reconstruct/light/fluence.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

/// `then` by what is known of its lamps in `now`. Places: a lamp that is seen in the same direction did not move.
/// Power: of one that is clipped in both images the newer estimate.
std::shared_ptr<const Illumination> as_known_in(const std::shared_ptr<const Illumination>& now,
                                                const Illumination& then) {
  if (then.time_ns == now->time_ns && !then.dimmed) return now;
  auto result = std::make_shared<Illumination>(then);
  for (PointLight& lamp : result->lights) {
    const PointLight* known = lamp_with_id(now->lights, lamp.id);
    if (!known || !known->distance_known || !(known->irradiance.array() > 0).all() ||
        angle_between(known->direction, lamp.direction) > kExposure.same_place_rad)
      continue;
    const Array3f power = lamp.clipped && known->clipped && !then.dimmed
                              ? Array3f::Ones()
                              : (lamp.irradiance.array() / known->irradiance.array()).eval();
    lamp = *known;
    lamp.irradiance.array() *= power;
    lamp.intensity.array() *= power;
  }
  return result;
}

/// How much better the frame fits `off` than `lit`, in σ of what the errors of the places explain.
double evidence_for(const PlacesSeenAgain& seen, const Illumination& off, const Illumination& lit) {
  double lit_minus_off = 0;  // Σ of the places' robust errors
  int count = 0;
  for (const Place& place : seen.places) {
    const SurfaceCell* cell = seen.cells.find(place);
    if (!cell || !cell->light) continue;
    const Array3f then = unoccluded_irradiance(*cell->light, cell->position_m, cell->normal);
    const Array3f change = (place.radiance / (seen.gain * cell->radiance)).log();
    const auto error = [&](const Illumination& now) {
      const Array3f too_bright = (unoccluded_irradiance(now, cell->position_m, cell->normal) / then).log() - change;
      const Array3f wrong = too_bright.max(place.dark ? Array3f::Zero().eval() : Array3f(-too_bright));
      return std::min(wrong.mean(), kExposure.max_hidden_error);
    };
    const float difference = error(lit) - error(off);
    if (!std::isfinite(difference)) continue;
    lit_minus_off += difference;
    ++count;
  }
  return lit_minus_off / (kExposure.texture_log_sigma *
                          std::sqrt(std::max(1.0, static_cast<double>(count) * kExposure.independent_matches)));
}

}  // namespace

SeenByColor check_hidden(const PlacesSeenAgain& seen, const Illumination& light) {
  SeenByColor result;
  Illumination supposed = light, off = light;
  if (std::erase_if(off.lights, [](const PointLight& lamp) { return lamp.hidden > 0; }) == 0) return result;
  if (evidence_for(seen, off, supposed) > 0) supposed = off;
  for (const PointLight& lamp : light.lights) {
    if (lamp.hidden == 0) continue;
    off = supposed;
    std::erase_if(off.lights, [&](const PointLight& other) { return other.id == lamp.id; });
    Illumination lit = off;
    lit.lights.push_back(lamp);
    const double evidence = evidence_for(seen, off, lit);
    if (std::abs(evidence) <= kExposure.step_sigmas) continue;
    (evidence > 0 ? result.off : result.lit).push_back(lamp.id);
    supposed = evidence > 0 ? off : lit;
  }
  return result;
}

std::optional<Dimming> dimming_since(const std::shared_ptr<const Illumination>& agreed, const PlacesSeenAgain& seen) {
  std::vector<DimmedPlace> seen_again;
  std::map<const Illumination*, std::shared_ptr<const Illumination>> lights;  // of the cells
  for (const Place& place : seen.places) {
    const SurfaceCell* cell = seen.cells.find(place);
    if (!cell || !cell->light) continue;
    std::shared_ptr<const Illumination>& light = lights[cell->light.get()];
    if (!light) light = as_known_in(agreed, *cell->light);
    const Array3f then = unoccluded_irradiance(*light, cell->position_m, cell->normal);
    if (!(then > 0).all()) continue;
    seen_again.push_back({place.radiance / (seen.gain * cell->radiance), {}, place.dark});
    DimmedPlace& dimmed = seen_again.back();
    for (const PointLight& lamp : agreed->lights)
      dimmed.parts.push_back(lamp_irradiance(lamp, cell->position_m, cell->normal) / then);
    dimmed.parts.push_back(environment_irradiance(*agreed, cell->normal) / then);
  }
  return fit_dimming(seen_again, *agreed);
}

std::shared_ptr<const LampShadows> shadows_seen(const PlacesSeenAgain& seen, const std::vector<Vector3f>& moved_m,
                                                const std::shared_ptr<const Illumination>& light) {
  std::vector<ShadowedPlace> seen_again;
  for (const Place& place : seen.places) {
    const SurfaceCell* cell = seen.cells.find(place);
    if (!cell || !cell->light) continue;
    const LightChange change = seen.cells.light_change(*cell, light);
    const float all = unoccluded_irradiance(*light, cell->position_m, cell->normal).mean();
    const float ratio = (place.radiance / (seen.gain * cell->radiance * change.ratio)).mean();
    if (!std::isfinite(change.log_sigma) || !std::isfinite(ratio) || !(all > 0)) continue;
    ShadowedPlace& shadowed = seen_again.emplace_back(ShadowedPlace{cell->position_m, ratio, {}});
    for (const PointLight& lamp : light->lights)
      shadowed.parts.push_back(lamp_irradiance(lamp, cell->position_m, cell->normal).mean() / all);
  }
  return observe_shadows(seen_again, moved_m, *light);
}

}  // namespace lumigraft::reconstruct
