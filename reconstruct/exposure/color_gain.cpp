#include "reconstruct/exposure/color_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "capture/camera/radiance.h"
#include "capture/camera/vignetting.h"
#include "capture/message_text.h"
#include "reconstruct/exposure/camera_match.h"
#include "reconstruct/exposure/dimming.h"
#include "reconstruct/exposure/new_surface.h"
#include "reconstruct/exposure/observed_shadows.h"
#include "reconstruct/exposure/parameters.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/math/median.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

/// A piece of surface: its radiance in earlier frames.
struct Cell {
  Vector3f position_m = Vector3f::Zero();  ///< tag frame
  Vector3f normal = Vector3f::Zero();
  Array3f radiance = Array3f::Zero();         ///< W/sr/m², under `light`
  std::shared_ptr<const Illumination> light;  ///< null: unknown
  Array3f around = Array3f::Ones();           ///< its mean_irradiance at the probe
  int observations = 0;
  int contradictions = 0;  ///< in a row
  std::uint64_t last_seen = 0;
};

/// Three coordinates and the axis next to the normal.
using CellKey = std::array<int, 4>;
struct CellKeyHash {
  std::size_t operator()(const CellKey& k) const {
    return BrickKeyHash()(BrickKey{k[0], k[1], k[2]}) ^ static_cast<std::size_t>(k[3]) * 50331653u;
  }
};

/// A place of this frame.
struct Place {
  CellKey key{};
  Vector3f position_m, normal;
  Array3f radiance;  ///< at gain 1, without vignetting; an upper bound if `dark`
  float corner;      ///< (θ / θ_corner)²
  bool dark;         ///< too dark to be measured
};

CellKey key_of(const Vector3f& position_m, const Vector3f& normal) {
  const Eigen::Vector3i at = (position_m / kExposure.cell_m).array().floor().cast<int>();
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return {at.x(), at.y(), at.z(), 2 * axis + (normal[axis] < 0 ? 1 : 0)};
}

struct PixelRadiance {
  Array3f radiance = Array3f::Zero();
  bool dark = false;  ///< see Place
};

/// Mean radiance of 3 × 3 pixels at gain 1; empty where one of them is clipped or outside.
std::optional<PixelRadiance> radiance_at(const capture::Frame& color, const capture::Response& response, int u, int v) {
  const bool linear = !color.radiance.empty();
  const int width = linear ? color.radiance.width : color.encoded.width;
  const int height = linear ? color.radiance.height : color.encoded.height;
  if (u < 1 || v < 1 || u + 1 >= width || v + 1 >= height) return std::nullopt;
  PixelRadiance result;
  for (int y = v - 1; y <= v + 1; ++y)
    for (int x = u - 1; x <= u + 1; ++x)
      for (int c = 0; c < 3; ++c) {
        if (linear) {
          const float value = color.radiance.at(x, y, c);
          if (!std::isfinite(value)) return std::nullopt;
          result.dark |= value <= 0;
          result.radiance[c] += std::max(value, std::numeric_limits<float>::min()) / 9;
          continue;
        }
        const std::uint8_t code = color.encoded.at(x, y, c);
        if (code >= capture::kFullScale) return std::nullopt;
        result.dark |= code < kExposure.min_code;
        const std::uint8_t bound = std::max(code, kExposure.min_code);
        result.radiance[c] += static_cast<float>(response.to_linear(bound, c) / color.exposure) / 9;
      }
  return result;
}

std::shared_ptr<const Illumination> without_lamps(const Illumination& light, const std::vector<int>& ids) {
  auto result = std::make_shared<Illumination>(light);
  std::erase_if(result->lights,
                [&](const PointLight& lamp) { return std::find(ids.begin(), ids.end(), lamp.id) != ids.end(); });
  return result;
}

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

Array3f environment_irradiance(const Illumination& light, const Vector3f& normal) {
  return sh_irradiance(light.environment_sh, normal).array().max(0.0f);
}

Dimming as_in_image(const Illumination& light) {
  Dimming result{.since_ns = light.time_ns, .lamps = {}, .environment = Array3f::Ones()};
  for (const PointLight& lamp : light.lights) result.lamps[lamp.id] = Array3f::Ones();
  return result;
}

std::string gain_warning(const Array3f& gain) {
  const Array3f logs = gain.log();
  const float level = logs.mean(), hue = (logs - level).abs().maxCoeff();
  if (std::abs(level) < kExposure.warning_log && hue < kExposure.hue_warning_log) return "";
  return capture::formatted(
      "the colour camera changed its exposure or white balance: its frames are %.2f, %.2f, %.2f times as bright (red, "
      "green, blue) as at first; the difference is compensated",
      gain[0], gain[1], gain[2]);
}

}  // namespace

Array3f unoccluded_irradiance(const Illumination& light, const Vector3f& position_m, const Vector3f& normal) {
  Array3f sum = environment_irradiance(light, normal);
  for (const PointLight& lamp : light.lights) sum += lamp_irradiance(lamp, position_m, normal);
  return sum;
}

struct ColorGainStage::State {
  State(const capture::Session& session)
      : camera(session.color),
        corner_rad(static_cast<float>(capture::corner_angle_rad(camera.model))),
        sampler(session.color.model) {
    set_falloff(falloff);
  }

  std::vector<Place> places_of(const capture::FrameSet& frame, const Eigen::Isometry3f& T_tag_camera) const;
  /// What a cell's light is now over what it was when its radiance was stored.
  struct LightChange {
    Array3f ratio = Array3f::Ones();  ///< at the cell, per channel
    float log_sigma = 0;              ///< 1σ of its log: by how much the cell's change differs from that at the probe
  };
  LightChange light_change(const Cell& cell, const std::shared_ptr<const Illumination>& light) const;
  struct Measurement {
    Array3f log_gain;
    float log_sigma;
    bool agrees;  ///< most places do; else light changed in a way that `light` does not show
  };
  double evidence_for(const std::vector<Place>& places, const Illumination& off, const Illumination& lit) const;
  SeenByColor check_hidden(const std::vector<Place>& places, const Illumination& light) const;
  std::optional<Measurement> measured(const std::vector<Place>& places,
                                      const std::shared_ptr<const Illumination>& light) const;
  std::optional<Dimming> dimming(const std::vector<Place>& places) const;
  bool is_bright_again(const std::vector<Place>& places) const;
  bool darkened(const std::vector<Place>& places) const;
  std::shared_ptr<const LampShadows> shadows(const std::vector<Place>& places, const std::vector<Vector3f>& moved_m,
                                             const std::shared_ptr<const Illumination>& light) const;
  bool may_be_in_shadow(const Cell& cell, const Array3f& error, const std::shared_ptr<const Illumination>& light) const;
  void follow(const Measurement& measurement);
  void learn(const std::vector<Place>& places, const std::shared_ptr<const Illumination>& light);
  void forget_oldest();
  float match_fisheye(const std::vector<Place>& places, const capture::FrameSet& frame,
                      const Eigen::Isometry3f& T_tag_camera, const Illumination& light);
  /// Compares the frame with the light; follows the gain of a frame with a pose of its own, and learns its places.
  void update(const capture::FrameSet& frame, const Pose& pose, const std::shared_ptr<const Illumination>& light,
              std::vector<Place> places, Result& result);
  void set_falloff(const Eigen::Array2f& falloff);
  std::vector<std::string> warnings() const;

  capture::ColorCamera camera;
  float corner_rad;  ///< θ_corner
  DepthSampler sampler;
  std::unordered_map<CellKey, Cell, CellKeyHash> cells;
  NewSurface new_surface;
  Array3f gain = Array3f::Ones();                   ///< over that of the first frames
  Array3f base = Array3f::Ones();                   ///< of the first frames, against the fish-eye
  Eigen::Array2f falloff = Eigen::Array2f::Zero();  ///< CameraMatch::falloff; zero if the session states vignetting
  std::shared_ptr<const capture::Image<float>> vignetting;  ///< of both; null: none
  Array3f around = Array3f::Ones();                         ///< mean_irradiance at the probe in this frame's light
  std::uint64_t frames = 0;
  /// The newest light that the fish-eye measured and a frame agreed with.
  std::shared_ptr<const Illumination> agreed;
  int unexplained_frames = 0;                 ///< in a row: places contradict light that did not change
  std::optional<std::uint64_t> contradicted;  ///< Illumination::version of light with which places disagreed
};

std::vector<Place> ColorGainStage::State::places_of(const capture::FrameSet& frame,
                                                    const Eigen::Isometry3f& T_tag_camera) const {
  std::vector<Place> places;
  const DepthGrid grid = sampler.sample(frame.depth->depth_m);
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c) {
      const DepthGrid::Point& point = grid.at(c, r);
      if (point.normal.isZero()) continue;
      const int u = grid.step * c + grid.step / 2, v = grid.step * r + grid.step / 2;
      auto seen = radiance_at(*frame.color, camera.response, u, v);
      if (!seen) continue;
      if (vignetting) seen->radiance *= vignetting->at(u, v);
      const float angle = std::atan2(point.position.head<2>().norm(), point.position.z()) / corner_rad;
      const Vector3f position_m = T_tag_camera * point.position, normal = T_tag_camera.linear() * point.normal;
      places.push_back({key_of(position_m, normal), position_m, normal, seen->radiance, angle * angle, seen->dark});
    }
  return places;
}

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

/// Occlusion and the distances of lamps make the change at a cell uncertain, but not one that is equal everywhere: a
/// cloud, a dimmer.
ColorGainStage::State::LightChange ColorGainStage::State::light_change(
    const Cell& cell, const std::shared_ptr<const Illumination>& light) const {
  if (!light || !cell.light || light->version == cell.light->version) return {};
  LightChange change;
  if (known_differently(*light, *cell.light)) {
    change.log_sigma = std::numeric_limits<float>::infinity();
    return change;
  }
  change.ratio = unoccluded_irradiance(*light, cell.position_m, cell.normal) /
                 unoccluded_irradiance(*cell.light, cell.position_m, cell.normal);
  change.log_sigma = (change.ratio / (around / cell.around)).log().abs().maxCoeff();
  return change;
}

/// How much better the frame fits `off` than `lit`, in σ of what the errors of the places explain.
double ColorGainStage::State::evidence_for(const std::vector<Place>& places, const Illumination& off,
                                           const Illumination& lit) const {
  double lit_minus_off = 0;  // Σ of the places' robust errors
  int count = 0;
  for (const Place& place : places) {
    const auto found = cells.find(place.key);
    if (found == cells.end() || !found->second.light) continue;
    const Cell& cell = found->second;
    const Array3f then = unoccluded_irradiance(*cell.light, cell.position_m, cell.normal);
    const Array3f seen = (place.radiance / (gain * cell.radiance)).log();
    const auto error = [&](const Illumination& now) {
      const Array3f too_bright = (unoccluded_irradiance(now, cell.position_m, cell.normal) / then).log() - seen;
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

/// Tries each hidden lamp, the strongest first, lit and switched off. Surface that the lamp hardly lights says nothing.
/// Where all went out together no lamp alone explains the frame, so the others are supposed lit or off as fits better.
SeenByColor ColorGainStage::State::check_hidden(const std::vector<Place>& places, const Illumination& light) const {
  SeenByColor result;
  Illumination supposed = light, off = light;
  if (std::erase_if(off.lights, [](const PointLight& lamp) { return lamp.hidden > 0; }) == 0) return result;
  if (evidence_for(places, off, supposed) > 0) supposed = off;
  for (const PointLight& lamp : light.lights) {
    if (lamp.hidden == 0) continue;
    off = supposed;
    std::erase_if(off.lights, [&](const PointLight& other) { return other.id == lamp.id; });
    Illumination lit = off;
    lit.lights.push_back(lamp);
    const double evidence = evidence_for(places, off, lit);
    if (std::abs(evidence) <= kExposure.step_sigmas) continue;
    (evidence > 0 ? result.off : result.lit).push_back(lamp.id);
    supposed = evidence > 0 ? off : lit;
  }
  return result;
}

/// The median of those around the last log gain, if they are many: shadows darken others. Else of all.
float near_gain(const std::vector<float>& logs, float last) {
  std::vector<float> near;
  for (const float value : logs) {
    if (std::abs(value - last) < kExposure.near_gain_log) near.push_back(value);
  }
  std::vector<float> used =
      static_cast<float>(near.size()) < kExposure.min_near_fraction * static_cast<float>(logs.size()) ? logs : near;
  return median(used);
}

/// Median log gain of the places; empty if too few places match.
std::optional<ColorGainStage::State::Measurement> ColorGainStage::State::measured(
    const std::vector<Place>& places, const std::shared_ptr<const Illumination>& light) const {
  std::array<std::vector<float>, 3> logs;
  std::vector<float> light_sigmas;
  for (const Place& place : places) {
    const auto cell = cells.find(place.key);
    if (place.dark || cell == cells.end()) continue;
    const LightChange change = light_change(cell->second, light);
    if (!std::isfinite(change.log_sigma)) continue;
    light_sigmas.push_back(change.log_sigma);
    const Array3f log_ratio = (place.radiance / (cell->second.radiance * change.ratio)).log();
    for (int c = 0; c < 3; ++c) logs[static_cast<std::size_t>(c)].push_back(log_ratio[c]);
  }
  if (light_sigmas.size() < kExposure.min_matches) return std::nullopt;
  Measurement result{.log_gain = {}, .log_sigma = 0, .agrees = true};
  for (int c = 0; c < 3; ++c) {
    std::vector<float>& values = logs[static_cast<std::size_t>(c)];
    const float middle = near_gain(values, std::log(gain[c]));
    const auto inliers = std::count_if(values.begin(), values.end(),
                                       [&](float value) { return std::abs(value - middle) < kExposure.inlier_log; });
    result.agrees &= static_cast<float>(inliers) >= kExposure.min_inlier_fraction * static_cast<float>(values.size());
    result.log_gain[c] = middle;
  }
  const float count = std::max(1.0f, static_cast<float>(light_sigmas.size()) / kExposure.independent_matches);
  // Errors of the light are common to all places: they do not average out.
  result.log_sigma = std::hypot(kExposure.texture_log_sigma / std::sqrt(count), median(light_sigmas));
  return result;
}

/// How the light changed since it agreed with a frame; empty if the places do not tell.
std::optional<Dimming> ColorGainStage::State::dimming(const std::vector<Place>& places) const {
  std::vector<DimmedPlace> seen_again;
  std::map<const Illumination*, std::shared_ptr<const Illumination>> lights;  // of the cells
  for (const Place& place : places) {
    const auto found = cells.find(place.key);
    if (found == cells.end() || !found->second.light) continue;
    const Cell& cell = found->second;
    std::shared_ptr<const Illumination>& light = lights[cell.light.get()];
    if (!light) light = as_known_in(agreed, *cell.light);
    const Array3f then = unoccluded_irradiance(*light, cell.position_m, cell.normal);
    if (!(then > 0).all()) continue;
    seen_again.push_back({place.radiance / (gain * cell.radiance), {}, place.dark});
    DimmedPlace& seen = seen_again.back();
    for (const PointLight& lamp : agreed->lights)
      seen.parts.push_back(lamp_irradiance(lamp, cell.position_m, cell.normal) / then);
    seen.parts.push_back(environment_irradiance(*agreed, cell.normal) / then);
  }
  return fit_dimming(seen_again, *agreed);
}

/// Whether the places agree with the fish-eye's image, at the gain that they had, once more.
bool ColorGainStage::State::is_bright_again(const std::vector<Place>& places) const {
  const auto measurement = measured(places, agreed);
  return measurement && measurement->agrees &&
         ((measurement->log_gain - gain.log()).abs() < kExposure.inlier_log).all();
}

/// Whether places that were bright enough to be measured are no more.
bool ColorGainStage::State::darkened(const std::vector<Place>& places) const {
  std::size_t seen_again = 0, dark = 0;
  for (const Place& place : places) {
    if (!cells.contains(place.key)) continue;
    ++seen_again;
    dark += place.dark ? 1 : 0;
  }
  return seen_again >= kExposure.min_matches &&
         static_cast<float>(dark) > kExposure.max_dark_fraction * static_cast<float>(seen_again);
}

std::shared_ptr<const LampShadows> ColorGainStage::State::shadows(
    const std::vector<Place>& places, const std::vector<Vector3f>& moved_m,
    const std::shared_ptr<const Illumination>& light) const {
  std::vector<ShadowedPlace> seen_again;
  for (const Place& place : places) {
    const auto found = cells.find(place.key);
    if (found == cells.end() || !found->second.light) continue;
    const Cell& cell = found->second;
    const LightChange change = light_change(cell, light);
    const float all = unoccluded_irradiance(*light, cell.position_m, cell.normal).mean();
    const float ratio = (place.radiance / (gain * cell.radiance * change.ratio)).mean();
    if (!std::isfinite(change.log_sigma) || !std::isfinite(ratio) || !(all > 0)) continue;
    ShadowedPlace& seen = seen_again.emplace_back(ShadowedPlace{cell.position_m, ratio, {}});
    for (const PointLight& lamp : light->lights)
      seen.parts.push_back(lamp_irradiance(lamp, cell.position_m, cell.normal).mean() / all);
  }
  return observe_shadows(seen_again, moved_m, *light);
}

/// Whether a cell is darker by no more than lamps give it.
bool ColorGainStage::State::may_be_in_shadow(const Cell& cell, const Array3f& error,
                                             const std::shared_ptr<const Illumination>& light) const {
  if (!light || !(error < 1).all()) return false;
  const Array3f rest = environment_irradiance(*light, cell.normal),
                all = unoccluded_irradiance(*light, cell.position_m, cell.normal);
  return (error > (1 - kExposure.inlier_log) * rest / all).all();
}

/// Changes within the noise are ignored: renderers reuse results as long as the gain is equal.
void ColorGainStage::State::follow(const Measurement& measurement) {
  const Array3f step = (measurement.log_gain - gain.log()).abs();
  if ((step > std::max(kExposure.step_sigmas * measurement.log_sigma, kExposure.min_log_step)).any())
    gain = measurement.log_gain.exp();
}

void ColorGainStage::State::learn(const std::vector<Place>& places, const std::shared_ptr<const Illumination>& light) {
  for (const Place& place : places) {
    if (place.dark) continue;
    Cell& cell = cells[place.key];
    const Array3f radiance = place.radiance / gain;
    cell.last_seen = frames;
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
        cell.around = around;
      }
    } else if (cell.observations == 0 || !(change.log_sigma < kExposure.inlier_log) ||
               ++cell.contradictions >= (may_be_in_shadow(cell, error, light) ? kExposure.shadow_replaced_after
                                                                              : kExposure.replaced_after)) {
      cell = {place.position_m, place.normal, radiance, light, around, 1, 0, frames};
    }
  }
  if (cells.size() > kExposure.max_cells) forget_oldest();
}

/// Drops cells that were observed less recently than the median.
void ColorGainStage::State::forget_oldest() {
  std::vector<std::uint64_t> seen;
  seen.reserve(cells.size());
  for (const auto& [key, cell] : cells) seen.push_back(cell.last_seen);
  const std::uint64_t middle = median(seen);
  std::erase_if(cells, [&](const auto& entry) { return entry.second.last_seen < middle; });
}

void ColorGainStage::State::set_falloff(const Eigen::Array2f& k) {
  falloff = k;
  capture::Vignetting lens = camera.vignetting;
  const double square = corner_rad * corner_rad;
  lens.terms[0] -= k[0] / square;
  lens.terms[1] -= k[1] / (square * square);
  vignetting =
      lens.none() ? nullptr : std::make_shared<capture::Image<float>>(capture::vignetting_gain(lens, camera.model));
  cells.clear();
}

/// Compares the frame with the fish-eye, and adopts what differs visibly and beyond its uncertainty from the estimate
/// in use: every correction makes what was measured before wrong. Returns ColorGainStage::Result::correction.
float ColorGainStage::State::match_fisheye(const std::vector<Place>& places, const capture::FrameSet& frame,
                                           const Eigen::Isometry3f& T_tag_camera, const Illumination& light) {
  std::vector<ColorPlace> seen;
  for (const Place& place : places) {
    if (place.dark) continue;
    const float estimated = std::exp(-(falloff[0] + falloff[1] * place.corner) * place.corner);
    seen.push_back({place.position_m, place.radiance / gain * estimated, place.corner});
  }
  std::vector<Vector3f> surface_m;
  for (const DepthGrid::Point& point : sampler.sample(frame.depth->depth_m).points)
    if (point.position.z() > 0) surface_m.push_back(T_tag_camera * point.position);
  const auto exceeds = [](float value, float sigma, float visible) {
    return std::abs(value) > std::max(kExposure.step_sigmas * sigma, visible);
  };

  auto match = match_cameras(seen, surface_m, light, camera.vignetting.none());
  // Lenses lose light in the corners: a gain there is an error.
  if (match && camera.vignetting.none() &&
      match->falloff.sum() < std::max(kExposure.step_sigmas * match->falloff_sigma, kExposure.match.min_corner_log))
    match = match_cameras(seen, surface_m, light, false);
  if (!match) return 0;
  float correction = 0;
  const float bend = (match->falloff - falloff).sum();
  if (exceeds(bend, match->falloff_sigma, kExposure.match.min_corner_log)) {
    set_falloff(match->falloff);
    correction = std::abs(bend);
  }
  const Array3f step = match->log_gain - base.log(), hue = step - step.mean();
  if (exceeds(step.mean(), match->level_sigma, kExposure.match.min_level_log) ||
      exceeds(hue.abs().maxCoeff(), match->hue_sigma, kExposure.match.min_hue_log)) {
    base = match->log_gain.exp();
    correction = std::max(correction, step.abs().maxCoeff());
  }
  return std::exp(correction) - 1;
}

void ColorGainStage::State::update(const capture::FrameSet& frame, const Pose& pose,
                                   const std::shared_ptr<const Illumination>& light, std::vector<Place> places,
                                   Result& result) {
  const std::shared_ptr<const Illumination> shining =
      result.light.off.empty() ? light : without_lamps(*light, result.light.off);
  if (shining) around = mean_irradiance(*shining, shining->probe_position_m);
  const auto measurement = measured(places, shining);
  const bool agrees = measurement && measurement->agrees;
  if (light && measurement && !agrees) contradicted = light->version;
  const bool outdated = light && (light->dimmed || contradicted == light->version) &&
                        frame.time_ns - light->time_ns > kExposure.stale_light_ns;
  if (agrees && light && !light->dimmed) agreed = shining;
  if (light && agreed && agreed->time_ns == light->time_ns) {
    if (light->dimmed && is_bright_again(places))
      result.light.dimming = as_in_image(*agreed);
    else if (!agrees)
      result.light.dimming = dimming(places);
  }
  const bool same_light =
      light && agreed && !light->dimmed &&
      (agreed->time_ns == light->time_ns || relative_change(*light, *agreed) < kExposure.same_light);
  // Gain and shadows need places to the centimetre. What went dark, such as the tag in a room whose lamps are off, does
  // not.
  if (pose.age_ns == 0) {
    std::vector<Vector3f> points_m;
    for (const Place& place : places) points_m.push_back(place.position_m);
    const std::vector<Vector3f> moved_m = new_surface.find(points_m, frame.time_ns);
    if (shining && !shining->dimmed && !outdated) result.shadows = shadows(places, moved_m, shining);
  }
  const bool unexplained = measurement && !agrees && same_light && !result.light.dimming && !result.shadows;
  unexplained_frames = unexplained ? unexplained_frames + 1 : 0;
  result.shows_room = !darkened(places) && (!unexplained || unexplained_frames > kExposure.replaced_after);
  if (outdated)
    result.warnings.push_back(
        std::string("the light in the colour frames changes and the fish-eye delivers no new frame, or the same one "
                    "again: ") +
        (light->dimmed ? "its lamps are as bright as the colour frames show" : "the last light is kept"));
  // Light that is not that of `light` is known from the next frame on.
  if (pose.age_ns > 0 || !result.shows_room || result.light.dimming) return;
  if (agrees) follow(*measurement);
  // Only a frame whose own gain is known can be compared with the fish-eye.
  const bool gain_is_known = agrees || cells.empty();
  if (light && !light->dimmed && gain_is_known &&
      (frames < kExposure.match.first || frames % kExposure.match.every == 0)) {
    const Eigen::Isometry3f T_tag_camera = pose.T_tag_camera.cast<float>();
    result.correction = match_fisheye(places, frame, T_tag_camera, *light);
    if (result.correction > 0) places = places_of(frame, T_tag_camera);
  }
  ++frames;
  learn(places, outdated && !light->dimmed ? nullptr : shining);
}

std::vector<std::string> ColorGainStage::State::warnings() const {
  std::vector<std::string> result;
  if (std::string warning = gain_warning(gain); !warning.empty()) result.push_back(std::move(warning));
  if (!base.isOnes(0))
    result.push_back(capture::formatted(
        "the colour camera shows places %.2f, %.2f, %.2f times as bright as the fish-eye (red, green, blue): white "
        "balance, exposure or response of one is not as the session says; the difference is compensated",
        base[0], base[1], base[2]));
  if (!falloff.isZero(0))
    result.push_back(
        capture::formatted("the colour camera loses %.0f %% of the light in its corners: this is compensated; "
                           "`lumigraft calibrate` measures its vignetting",
                           100 * (1 - std::exp(-falloff.sum()))));
  return result;
}

ColorGainStage::ColorGainStage(const capture::Session& session) : state_(std::make_unique<State>(session)) {}

ColorGainStage::~ColorGainStage() = default;

ColorGainStage::Result ColorGainStage::estimate(const capture::FrameSet& frame, const std::optional<Pose>& pose,
                                                const std::shared_ptr<const Illumination>& light) {
  State& s = *state_;
  Result result;
  if (frame.color && frame.depth && pose) {
    const Eigen::Isometry3f T_tag_camera = pose->T_tag_camera.cast<float>();
    std::vector<Place> places = s.places_of(frame, T_tag_camera);
    if (light) result.light = s.check_hidden(places, *light);
    if (std::count_if(places.begin(), places.end(), [](const Place& place) { return place.dark; }) >
        kExposure.max_dark_fraction * static_cast<float>(places.size()))
      result.warnings.push_back("the colour frame is too dark to show exposure and light");
    s.update(frame, *pose, light, std::move(places), result);
  }
  result.gain = s.base * s.gain;
  result.vignetting = s.vignetting;
  for (std::string& warning : s.warnings()) result.warnings.push_back(std::move(warning));
  return result;
}

}  // namespace lumigraft::reconstruct
