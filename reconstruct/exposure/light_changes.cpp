#include "reconstruct/exposure/light_changes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruct/exposure/dimming.h"
#include "reconstruct/exposure/observed_shadows.h"
#include "reconstruct/exposure/parameters.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/math/median.h"

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

/// By how much a light predicts each place too bright, as a log.
struct PredictionErrors {
  std::vector<Array3f> log_error;
  std::vector<bool> upper_bound;  ///< the place is too dark to be measured

  /// Sum over the places of the mean over the channels; a place counts as kExposure.max_hidden_error at most.
  double sum(const Array3f& log_gain) const {
    double result = 0;
    for (std::size_t i = 0; i < log_error.size(); ++i) {
      const Array3f too_bright = log_error[i] + log_gain;
      const Array3f wrong = too_bright.max(upper_bound[i] ? Array3f::Zero().eval() : Array3f(-too_bright));
      result += std::min(wrong.mean(), kExposure.max_hidden_error);
    }
    return result;
  }

  /// Change of gain, per channel, with the least sum of absolute errors; empty if most places do not show one.
  std::optional<Array3f> log_gain() const {
    Array3f result;
    for (int c = 0; c < 3; ++c) {
      std::vector<float> logs;
      for (std::size_t i = 0; i < log_error.size(); ++i)
        if (!upper_bound[i] && std::isfinite(log_error[i][c])) logs.push_back(-log_error[i][c]);
      if (2 * logs.size() <= log_error.size()) return std::nullopt;
      result[c] = median(logs);
    }
    return result;
  }
};

/// How much better the frame fits `off` than `lit`, in σ of what the errors of the places explain. The camera may have
/// changed its gain in the same frame, as automatic exposure does when a lamp goes off; where the light explains the
/// frame without that, it is more probable.
double evidence_for(const PlacesSeenAgain& seen, const Illumination& off, const Illumination& lit) {
  PredictionErrors with_off, with_lit;
  for (const Place& place : seen.places) {
    const SurfaceCell* cell = seen.cells.find(place);
    if (!cell || !cell->light) continue;
    const Array3f then = unoccluded_irradiance(*cell->light, cell->position_m, cell->normal);
    const Array3f change = (place.radiance / (seen.gain * cell->radiance)).log();
    const auto error = [&](const Illumination& now) {
      return Array3f((unoccluded_irradiance(now, cell->position_m, cell->normal) / then).log() - change);
    };
    const Array3f off_error = error(off), lit_error = error(lit);
    if (off_error.isNaN().any() || lit_error.isNaN().any()) continue;
    with_off.log_error.push_back(off_error);
    with_lit.log_error.push_back(lit_error);
    for (PredictionErrors* errors : {&with_off, &with_lit}) errors->upper_bound.push_back(place.dark);
  }
  const auto count = static_cast<double>(with_off.log_error.size());
  const double sigma = kExposure.texture_log_sigma * std::sqrt(std::max(1.0, count * kExposure.independent_matches));
  const auto cost = [&](const PredictionErrors& errors) {
    const double same_gain = errors.sum(Array3f::Zero());
    const auto log_gain = errors.log_gain();
    return log_gain ? std::min(same_gain, errors.sum(*log_gain) + kExposure.other_gain_sigmas * sigma) : same_gain;
  };
  return (cost(with_lit) - cost(with_off)) / sigma;
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
    const Array3f all = unoccluded_irradiance(*light, cell->position_m, cell->normal);
    const Array3f ratio = place.radiance / (seen.gain * cell->radiance * change.ratio);
    if (!std::isfinite(change.log_sigma) || !ratio.isFinite().all() || !(all > 0).all()) continue;
    ShadowedPlace& shadowed = seen_again.emplace_back(ShadowedPlace{cell->position_m, cell->normal, ratio, {}});
    for (const PointLight& lamp : light->lights)
      shadowed.parts.push_back(lamp_irradiance(lamp, cell->position_m, cell->normal) / all);
  }
  return observe_shadows(seen_again, moved_m, *light);
}

}  // namespace lumigraft::reconstruct
