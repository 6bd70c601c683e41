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

void SurfaceCells::set_light(const std::shared_ptr<const Illumination>& light) {
  light_ = light;
  changes_.clear();
  if (light) around_ = mean_irradiance(*light, light->probe_position_m);
}

double SurfaceCells::change_from(const Illumination* other) const {
  if (!light_ || !other) return light_.get() == other ? 0 : 1;
  const auto [entry, is_new] = changes_.try_emplace(other, 0);
  if (is_new) entry->second = relative_change(*light_, *other);
  return entry->second;
}

std::size_t SurfaceCells::nearest(const Lights& cell) const {
  if (cell[1].observations == 0) return 0;
  const double first = change_from(cell[0].light.get()), second = change_from(cell[1].light.get());
  if (first == second) return cell[0].last_seen >= cell[1].last_seen ? 0 : 1;
  return first < second ? 0 : 1;
}

const SurfaceCell* SurfaceCells::find(const Place& place) const {
  const int number = numbers_.find(place.key);
  if (number < 0) return nullptr;
  const Lights& lights = cells_[static_cast<std::size_t>(number)].lights;
  return &lights[nearest(lights)];
}

/// Occlusion and the distances of lamps make the change at a cell uncertain, but not one that is equal everywhere: a
/// cloud, a dimmer.
LightChange SurfaceCells::light_change(const SurfaceCell& cell,
                                       const std::shared_ptr<const Illumination>& light) const {
  if (!light || !cell.light || light->version == cell.light->version) return {};
  LightChange change;
  if (known_differently(*light, *cell.light)) {
    // Both may be the same light, as the fish-eye sees it.
    const auto difference = static_cast<float>(relative_change(*light, *cell.light));
    change.log_sigma = difference < kExposure.same_light ? difference : std::numeric_limits<float>::infinity();
    return change;
  }
  change.ratio = unoccluded_irradiance(*light, cell.position_m, cell.normal) /
                 unoccluded_irradiance(*cell.light, cell.position_m, cell.normal);
  change.log_sigma = (change.ratio / (around_ / cell.around)).log().abs().maxCoeff();
  return change;
}

void SurfaceCells::learn(const std::vector<Place>& places, const Array3f& gain, bool gain_is_known,
                         const std::shared_ptr<const Illumination>& light) {
  ++frames_;
  for (const Place& place : places) {
    if (place.dark) continue;
    const Array3f radiance = place.radiance / gain;
    const SurfaceCell now{place.position_m, place.normal, radiance, light, around_, 1, 0, frames_};
    const int number = numbers_.find(place.key);
    if (number < 0) {
      if (!gain_is_known) continue;
      cells_.push_back({place.key, {now, {}}});
      numbers_.insert(place.key, static_cast<int>(cells_.size() - 1));
      continue;
    }
    Lights& lights = cells_[static_cast<std::size_t>(number)].lights;
    const std::size_t index = nearest(lights);
    SurfaceCell &cell = lights[index], &other = lights[1 - index];
    cell.last_seen = frames_;
    if (light && light->dimmed) continue;  // that light follows from the cells
    const LightChange change = light_change(cell, light);
    const Array3f error = radiance / (cell.radiance * change.ratio);
    const bool same_light = change.log_sigma < kExposure.inlier_log;
    if (same_light && (error.log().abs() < kExposure.inlier_log).all()) {
      cell.observations = std::min(cell.observations + 1, kExposure.max_average);
      cell.radiance *= (1 + (error - 1) / static_cast<float>(cell.observations));
      cell.contradictions = 0;
      if (!cell.light || !light) {
        cell.light = light;
        cell.around = around_;
      }
    } else if (!same_light && gain_is_known) {
      other = now;
    } else if (++cell.contradictions >=
               (may_be_in_shadow(cell, error, light) ? kExposure.shadow_replaced_after : kExposure.replaced_after)) {
      lights = {now, {}};
    }
  }
  if (cells_.size() > kExposure.max_cells) forget_oldest();
}

/// Drops cells that were observed less recently than the median.
void SurfaceCells::forget_oldest() {
  std::vector<std::uint64_t> seen;
  seen.reserve(cells_.size());
  const auto last_seen = [](const Cell& cell) { return std::max(cell.lights[0].last_seen, cell.lights[1].last_seen); };
  for (const Cell& cell : cells_) seen.push_back(last_seen(cell));
  const std::uint64_t middle = median(seen);
  std::erase_if(cells_, [&](const Cell& cell) { return last_seen(cell) < middle; });
  numbers_.clear();
  for (std::size_t i = 0; i < cells_.size(); ++i) numbers_.insert(cells_[i].key, static_cast<int>(i));
}

}  // namespace lumigraft::reconstruct
