#include "reconstruct/exposure/color_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "capture/camera/vignetting.h"
#include "capture/message_text.h"
#include "reconstruct/exposure/camera_match.h"
#include "reconstruct/exposure/light_changes.h"
#include "reconstruct/exposure/new_surface.h"
#include "reconstruct/exposure/parameters.h"
#include "reconstruct/exposure/places.h"
#include "reconstruct/exposure/surface_cells.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

std::shared_ptr<const Illumination> without_lamps(const Illumination& light, const std::vector<int>& ids) {
  auto result = std::make_shared<Illumination>(light);
  std::erase_if(result->lights,
                [&](const PointLight& lamp) { return std::find(ids.begin(), ids.end(), lamp.id) != ids.end(); });
  return result;
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

/// The median of those around it, found from the last log gain on, if there are many around that: shadows darken
/// others. Else of all.
float near_gain(const std::vector<float>& logs, float last) {
  float middle = last;
  std::vector<float> near;
  for (int round = 0; round < kExposure.near_rounds; ++round) {
    near.clear();
    for (const float value : logs) {
      if (std::abs(value - middle) < kExposure.near_gain_log) near.push_back(value);
    }
    if (static_cast<float>(near.size()) < kExposure.min_near_fraction * static_cast<float>(logs.size())) {
      std::vector<float> all = logs;
      return median(all);
    }
    const float last_middle = std::exchange(middle, median(near));
    if (middle == last_middle) break;
  }
  return middle;
}

}  // namespace

struct ColorGainStage::State {
  State(const capture::Session& session) : camera(session.color), sampler(session.color, session.depth_noise()) {
    set_falloff(falloff);
  }

  std::vector<Place> places_of(const capture::FrameSet& frame, const Eigen::Isometry3f& T_tag_camera) const {
    return sampler.places(frame, T_tag_camera, vignetting.get());
  }
  PlacesSeenAgain seen_again(const std::vector<Place>& places) const { return {places, cells, gain}; }
  struct Measurement {
    Array3f log_gain;
    float log_sigma;    ///< 1σ that other frames do not share
    float light_sigma;  ///< 1σ that frames in the same light share
    bool agrees;        ///< most places do; else light changed in a way that `light` does not show
  };
  std::optional<Measurement> measured(const std::vector<Place>& places,
                                      const std::shared_ptr<const Illumination>& light) const;
  bool is_bright_again(const std::vector<Place>& places) const;
  bool darkened(const std::vector<Place>& places) const;
  void follow(const Measurement& measurement);
  float match_fisheye(const std::vector<Place>& places, const capture::FrameSet& frame,
                      const Eigen::Isometry3f& T_tag_camera, const Illumination& light);
  /// Compares the frame with the light; follows the gain of a frame with a pose of its own, and learns its places.
  void update(const capture::FrameSet& frame, const Pose& pose, const std::shared_ptr<const Illumination>& light,
              std::vector<Place> places, Result& result);
  void set_falloff(const Eigen::Array2f& falloff);
  std::vector<std::string> warnings() const;

  capture::ColorCamera camera;
  PlaceSampler sampler;
  SurfaceCells cells;
  NewSurface new_surface;
  Array3f gain = Array3f::Ones();                   ///< over that of the first frames
  float gain_light_sigma = 0;                       ///< Measurement::light_sigma of the frame that `gain` is from
  Array3f base = Array3f::Ones();                   ///< of the first frames, against the fish-eye
  Eigen::Array2f falloff = Eigen::Array2f::Zero();  ///< CameraMatch::falloff; zero if the session states vignetting
  std::shared_ptr<const capture::Image<float>> vignetting;  ///< of both; null: none
  std::uint64_t frames = 0;
  /// The newest light that the fish-eye measured and a frame agreed with.
  std::shared_ptr<const Illumination> agreed;
  int unexplained_frames = 0;                 ///< in a row: places contradict light that did not change
  std::optional<std::uint64_t> contradicted;  ///< Illumination::version of light with which places disagreed
};

/// Median log gain of the places; empty if too few places match.
std::optional<ColorGainStage::State::Measurement> ColorGainStage::State::measured(
    const std::vector<Place>& places, const std::shared_ptr<const Illumination>& light) const {
  std::array<std::vector<float>, 3> logs;
  std::vector<float> light_sigmas;
  for (const Place& place : places) {
    const SurfaceCell* cell = cells.find(place);
    if (place.dark || !cell) continue;
    const LightChange change = cells.light_change(*cell, light);
    if (!std::isfinite(change.log_sigma)) continue;
    light_sigmas.push_back(change.log_sigma);
    const Array3f log_ratio = (place.radiance / (cell->radiance * change.ratio)).log();
    for (int c = 0; c < 3; ++c) logs[static_cast<std::size_t>(c)].push_back(log_ratio[c]);
  }
  if (light_sigmas.size() < kExposure.min_matches) return std::nullopt;
  Measurement result{.log_gain = {}, .log_sigma = 0, .light_sigma = 0, .agrees = true};
  float spread = 0;  // 1σ
  for (int c = 0; c < 3; ++c) {
    std::vector<float>& values = logs[static_cast<std::size_t>(c)];
    const float middle = near_gain(values, std::log(gain[c]));
    const auto inliers = std::count_if(values.begin(), values.end(),
                                       [&](float value) { return std::abs(value - middle) < kExposure.inlier_log; });
    result.agrees &= static_cast<float>(inliers) >= kExposure.min_inlier_fraction * static_cast<float>(values.size());
    result.log_gain[c] = middle;
    for (float& value : values) value = std::abs(value - middle);
    spread = std::max(spread, 1.48f * median(values));
  }
  const float count = std::max(1.0f, static_cast<float>(light_sigmas.size()) / kExposure.independent_matches);
  result.log_sigma = kExposure.texture_log_sigma / std::sqrt(count);
  // Light that is predicted wrongly is so in one place more than in another.
  result.light_sigma = std::min(median(light_sigmas), spread);
  return result;
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
    if (!cells.find(place)) continue;
    ++seen_again;
    dark += place.dark ? 1 : 0;
  }
  return seen_again >= kExposure.min_matches &&
         static_cast<float>(dark) > kExposure.max_dark_fraction * static_cast<float>(seen_again);
}

/// Changes within the noise are ignored: renderers reuse results as long as the gain is equal. Errors of the light are
/// common to all places, so they do not average out, and to the measurement that the gain is from, as far as that was
/// made in the same light: a step contains the difference alone. Otherwise the gain of a camera that adapts to light
/// that changed much is not followed.
void ColorGainStage::State::follow(const Measurement& measurement) {
  const Array3f step = (measurement.log_gain - gain.log()).abs();
  const float sigma = std::hypot(measurement.log_sigma, measurement.light_sigma - gain_light_sigma);
  if (!(step > std::max(kExposure.step_sigmas * sigma, kExposure.min_log_step)).any()) return;
  gain = measurement.log_gain.exp();
  gain_light_sigma = measurement.light_sigma;
}

void ColorGainStage::State::set_falloff(const Eigen::Array2f& k) {
  falloff = k;
  capture::Vignetting lens = camera.vignetting;
  const double square = sampler.corner_rad() * sampler.corner_rad();
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
    seen.push_back({place.position_m, place.normal, place.radiance / gain * estimated, place.corner});
  }
  const std::vector<Vector3f> surface_m = sampler.surface_m(*frame.depth, T_tag_camera);
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
  cells.set_light(shining);
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
      result.light.dimming = dimming_since(agreed, seen_again(places));
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
    if (shining && !shining->dimmed && !outdated) result.shadows = shadows_seen(seen_again(places), moved_m, shining);
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
  // Only a frame whose own gain is known can be compared with the fish-eye. Surface that is new, with nothing to
  // compare, is learnt with the last gain; what contradicts the light is not.
  const bool gain_is_known = agrees || cells.empty();
  if (light && !light->dimmed && gain_is_known &&
      (frames < kExposure.match.first || frames % kExposure.match.every == 0)) {
    const Eigen::Isometry3f T_tag_camera = pose.T_tag_camera.cast<float>();
    result.correction = match_fisheye(places, frame, T_tag_camera, *light);
    if (result.correction > 0) places = places_of(frame, T_tag_camera);
  }
  ++frames;
  cells.learn(places, gain, agrees || !measurement, outdated && !light->dimmed ? nullptr : shining);
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
    s.cells.set_light(light);
    if (light) result.light = check_hidden(s.seen_again(places), *light);
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
