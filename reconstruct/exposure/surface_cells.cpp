#include "reconstruct/exposure/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/exposure/parameters.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;

/// Whether a lamp's distance is known under one light and not under the other, or a lamp of unknown distance is new
/// where others are known: then the change is that of our knowledge.
bool known_differently(const Illumination& now, const Illumination& then) {
  const auto is_known = [](const PointLight& lamp) { return lamp.distance_known; };
  const bool some_known = std::any_of(then.lights.begin(), then.lights.end(), is_known);
  return std::any_of(now.lights.begin(), now.lights.end(), [&](const PointLight& lamp) {
    const PointLight* was = lamp_with_id(then.lights, lamp.id);
    return was ? was->distance_known != lamp.distance_known : some_known && !lamp.distance_known;
  });
}

/// Whether a cell is darker by no more than lamps give it.
bool may_be_in_shadow(const SurfaceCell& cell, const Array3f& error, const std::shared_ptr<const Illumination>& light) {
  if (!light || !(error < 1).all()) return false;
  const Array3f rest = environment_irradiance(*light, cell.normal),
                all = unoccluded_irradiance(*light, cell.position_m, cell.normal);
  return (error > (1 - kExposure.inlier_log) * rest / all).all();
}

}  // namespace

const SurfaceCell* SurfaceCells::find(const Place& place) const {
  const auto found = cells_.find(place.key);
  return found == cells_.end() ? nullptr : &found->second;
}

/// Occlusion and the distances of lamps make the change at a cell uncertain, but not one that is equal everywhere: a
/// cloud, a dimmer.
LightChange SurfaceCells::light_change(const SurfaceCell& cell,
                                       const std::shared_ptr<const Illumination>& light) const {
  if (!light || !cell.light || light->version == cell.light->version) return {};
  LightChange change;
  if (known_differently(*light, *cell.light)) {
    change.log_sigma = std::numeric_limits<float>::infinity();
    return change;
  }
  change.ratio = unoccluded_irradiance(*light, cell.position_m, cell.normal) /
                 unoccluded_irradiance(*cell.light, cell.position_m, cell.normal);
  change.log_sigma = (change.ratio / (around_ / cell.around)).log().abs().maxCoeff();
  return change;
}

void SurfaceCells::learn(const std::vector<Place>& places, const Array3f& gain,
                         const std::shared_ptr<const Illumination>& light) {
  ++frames_;
  for (const Place& place : places) {
    if (place.dark) continue;
    SurfaceCell& cell = cells_[place.key];
    const Array3f radiance = place.radiance / gain;
    cell.last_seen = frames_;
    if (cell.observations > 0 && light && light->dimmed) continue;  // that light follows from the cells
    const LightChange change = cell.observations == 0 ? LightChange() : light_change(cell, light);
    const Array3f error = radiance / (cell.radiance * change.ratio);
    if (cell.observations > 0 && change.log_sigma < kExposure.inlier_log &&
        (error.log().abs() < kExposure.inlier_log).all()) {
      cell.observations = std::min(cell.observations + 1, kExposure.max_average);
      cell.radiance *= (1 + (error - 1) / static_cast<float>(cell.observations));
      cell.contradictions = 0;
      if (!cell.light || !light) {
        cell.light = light;
        cell.around = around_;
      }
    } else if (cell.observations == 0 || !(change.log_sigma < kExposure.inlier_log) ||
               ++cell.contradictions >= (may_be_in_shadow(cell, error, light) ? kExposure.shadow_replaced_after
                                                                              : kExposure.replaced_after)) {
      cell = {place.position_m, place.normal, radiance, light, around_, 1, 0, frames_};
    }
  }
  if (cells_.size() > kExposure.max_cells) forget_oldest();
}

/// Drops cells that were observed less recently than the median.
void SurfaceCells::forget_oldest() {
  std::vector<std::uint64_t> seen;
  seen.reserve(cells_.size());
  for (const auto& [key, cell] : cells_) seen.push_back(cell.last_seen);
  const std::uint64_t middle = median(seen);
  std::erase_if(cells_, [&](const auto& entry) { return entry.second.last_seen < middle; });
}

}  // namespace lumigraft::reconstruct
