#include "reconstruct/light/light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/radiance.h"
#include "capture/camera/response.h"
#include "capture/frame.h"
#include "capture/message_text.h"
#include "reconstruct/light/environment.h"
#include "reconstruct/light/lamp_tag_matching.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/light/split.h"
#include "reconstruct/light/tracking.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const LightParameters::Occlusion& kOcclusion = kLightParameters.occlusion;

/// Median radiance of a colour image, mean of the channels; empty if there is no image. Pixel values that are too dark
/// to be measured count as no light.
std::optional<float> median_radiance(const capture::Frame* color, const capture::Response& response) {
  if (!color) return std::nullopt;
  const bool linear = !color->radiance.empty();
  const int width = linear ? color->radiance.width : color->encoded.width;
  const int height = linear ? color->radiance.height : color->encoded.height;
  std::vector<float> levels;
  for (int v = 0; v < height; v += kOcclusion.pixel_step) {
    for (int u = 0; u < width; u += kOcclusion.pixel_step) {
      float sum = 0;
      for (int c = 0; c < 3; ++c) {
        if (linear) {
          sum += color->radiance.at(u, v, c);
        } else if (const std::uint8_t code = color->encoded.at(u, v, c); code >= kOcclusion.min_code) {
          sum += static_cast<float>(response.to_linear(code, c) / color->exposure);
        }
      }
      levels.push_back(sum / 3);
    }
  }
  return levels.empty() ? std::nullopt : std::optional(median(levels));
}

/// Detection of a covered fish-eye: it measures no light while the colour camera sees the room as before.
class OcclusionCheck {
 public:
  struct Finding {
    bool covered = false;  ///< the image must not be used: the previous light stays
    std::string warning;   ///< empty if nothing is wrong
  };
  /// `flux`: ∫ L dω over the fish-eye image, mean of channels; a lower bound if `clipped`. `room_radiance`:
  /// median_radiance of the colour image of the same moment.
  Finding check(double flux, std::optional<float> room_radiance, bool clipped) {
    Finding finding;
    // Without a colour image that shows the lamps still on, the room may really be dark.
    if (seen_ && flux < kOcclusion.max_flux_ratio * flux_ && room_radiance && room_radiance_ && *room_radiance_ > 0 &&
        *room_radiance > kOcclusion.min_colour_ratio * *room_radiance_) {
      finding.covered = true;
      finding.warning =
          "the fish-eye is covered: its image became dark and the colour image did not; the last light is kept";
      return finding;
    }
    seen_ = true;
    flux_ = flux;
    room_radiance_ = room_radiance;
    if (!clipped && room_radiance && std::numbers::pi * *room_radiance > kOcclusion.max_returned_ratio * flux) {
      finding.warning =
          "the fish-eye measures far less light than the room reflects to the colour camera: it is covered, "
          "or one of their exposures is wrong";
    }
    return finding;
  }

 private:
  bool seen_ = false;
  double flux_ = 0;  ///< of the last image that was not covered
  std::optional<float> room_radiance_;
};

constexpr int kEnvironmentWidth = kLightParameters.environment.width;
constexpr int kEnvironmentHeight = kLightParameters.environment.height;

bool same_content(const capture::FisheyeFrames& a, const capture::FisheyeFrames& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
    return p == q ||
           (p->exposure == q->exposure && p->encoded.data == q->encoded.data && p->radiance.data == q->radiance.data);
  });
}

PointLight point_light(const SplitLamp& lamp) {
  PointLight light;
  light.direction = lamp.direction;
  light.irradiance = lamp.irradiance;
  const double cosine = 1 - lamp.solid_angle_sr / (2 * std::numbers::pi);
  light.angular_radius_rad = static_cast<float>(std::acos(std::clamp(cosine, -1.0, 1.0)));
  light.clipped = lamp.clipped;
  light.squareness = lamp.squareness;
  light.outline_u = lamp.outline_u;
  light.outline_v = lamp.outline_v;
  light.region = lamp.region;
  return light;
}

double flux_of(const capture::Image<float>& radiance, const FisheyeView& view) {
  double sum = 0;
  for (std::size_t i = 0; i < view.solid_angle_sr.size(); ++i) {
    const float* const rgb = &radiance.data[3 * i];
    if (view.sees(i)) sum += double(rgb[0] + rgb[1] + rgb[2]) / 3 * view.solid_angle_sr[i];
  }
  return sum;
}

/// Clipped pixels from which no lamp was removed.
capture::Image<std::uint8_t> still_clipped(const capture::RadianceImage& picture, const LightSplit& split) {
  capture::Image<std::uint8_t> result = picture.clipped;
  for (std::size_t i = 0; i < result.data.size(); ++i) {
    const auto same =
        std::equal(&split.residual.data[3 * i], &split.residual.data[3 * i] + 3, &picture.radiance.data[3 * i]);
    if (!same) result.data[i] = 0;
  }
  return result;
}

std::string hidden_warning(const Illumination& illumination) {
  const auto count = std::count_if(illumination.lights.begin(), illumination.lights.end(),
                                   [](const PointLight& light) { return light.hidden > 0; });
  if (count == 0) return "";
  return std::to_string(count) + (count == 1 ? " lamp is" : " lamps are") +
         " no longer visible in the fish-eye frame: kept while the colour camera shows the light, else faded out";
}

std::string clipped_warning(const Illumination& illumination) {
  const auto count = std::count_if(illumination.lights.begin(), illumination.lights.end(),
                                   [](const PointLight& light) { return light.clipped; });
  if (count == 0) return {};
  return capture::formatted("%d lamp%s clipped in the fish-eye frame: %s power is a lower bound (%.2f %% of pixels)",
                            static_cast<int>(count), count == 1 ? " is" : "s are", count == 1 ? "its" : "their",
                            100 * illumination.clipped_fraction);
}

bool changes_anything(const Dimming& dimming) {
  return !dimming.environment.isOnes(0) || std::any_of(dimming.lamps.begin(), dimming.lamps.end(),
                                                       [](const auto& lamp) { return !lamp.second.isOnes(0); });
}

/// Lamps without power are removed.
void dim(const Dimming& dimming, Illumination& light) {
  light.dimmed = true;
  std::erase_if(light.lights, [&](PointLight& lamp) {
    const auto found = dimming.lamps.find(lamp.id);
    // A lamp that was found to be a reflection is part of the environment.
    const Eigen::Array3f factor = found == dimming.lamps.end() ? dimming.environment : found->second;
    lamp.irradiance.array() *= factor;
    lamp.intensity.array() *= factor;
    return lamp.irradiance.isZero();
  });
  capture::Image<float>& radiance = light.environment.radiance;
  for (std::size_t i = 0; i < radiance.data.size(); ++i)
    radiance.data[i] *= dimming.environment[static_cast<Eigen::Index>(i % 3)];
  for (Vector3f& coefficient : light.environment_sh) coefficient.array() *= dimming.environment;
}

/// Irradiance at the probe per channel, as the columns of three vectors towards the lamp; zero for no lamp.
Eigen::Matrix3f irradiance_vectors(const PointLight* lamp) {
  return lamp ? Eigen::Matrix3f(lamp->direction * lamp->irradiance.transpose()) : Eigen::Matrix3f::Zero();
}

}  // namespace

float angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::acos(std::clamp(a.dot(b), -1.0f, 1.0f));
}

const PointLight* lamp_with_id(const std::vector<PointLight>& lights, int id) {
  const auto found = std::find_if(lights.begin(), lights.end(), [&](const PointLight& l) { return l.id == id; });
  return found == lights.end() ? nullptr : &*found;
}

float PointLight::emission(const Eigen::Vector3f& towards) const {
  return flat ? std::max(0.0f, normal.dot(towards)) / std::max(-normal.dot(direction), kMinSlantCosine) : 1.0f;
}

struct LightStage::State {
  explicit State(const capture::Session& session) : tracker(kLightParameters.max_lights), tag_matcher(session) {}

  Illumination illuminate(const capture::RadianceImage& picture) const;
  void place(const std::vector<LampTagPose>& tags, bool fresh);

  std::optional<capture::FisheyeCamera> camera;
  capture::Response color_response = capture::Response::srgb();
  OcclusionCheck occlusion;
  std::string level_warning;  ///< of the last image that was not covered
  FisheyeView view;
  capture::Image<float> vignetting_gain;
  std::optional<EnvironmentResampler> resampler;
  LightTracker tracker;
  LampTagMatcher tag_matcher;
  capture::FisheyeFrames last_frames;
  std::shared_ptr<const Illumination> seen;  ///< from the last image alone,
  std::shared_ptr<const Illumination> last;  ///< and with the positions of lamp tags
  std::vector<std::string> tag_warnings;
  std::vector<PointLight> placed;  ///< lamps of `last`, before dimming
  std::optional<Dimming> dimming;
  bool dimming_is_new = false;
  std::uint64_t version = 0;
};

LightStage::LightStage(const capture::Session& session) : state_(std::make_unique<State>(session)) {
  state_->camera = session.fisheye;
  state_->color_response = session.color.response;
  if (!session.fisheye) return;
  state_->view = fisheye_view(*session.fisheye);
  state_->vignetting_gain = capture::vignetting_gain(session.fisheye->vignetting, session.fisheye->model);
  state_->resampler.emplace(*session.fisheye, state_->view, kEnvironmentWidth, kEnvironmentHeight);
}

LightStage::~LightStage() = default;

Illumination LightStage::State::illuminate(const capture::RadianceImage& picture) const {
  const LightSplit split = split_lamps(picture.radiance, picture.clipped, view, kLightParameters.max_lights);
  Illumination now;
  now.probe_position_m = camera->T_tag_fisheye.translation().cast<float>();
  for (const SplitLamp& lamp : split.lamps) {
    now.lights.push_back(point_light(lamp));
    now.lights.back().id = static_cast<int>(now.lights.size());  // provisional, until LightTracker assigns it
  }
  const capture::Image<std::uint8_t> clipped = still_clipped(picture, split);
  now.environment = resampler->resample(split.residual, view, clipped.empty() ? nullptr : &clipped);
  now.environment_sh = project_sh(now.environment);
  now.clipped_fraction = picture.clipped_fraction;
  return now;
}

/// Combines the image with lamp tags if either changed; `fresh`: the image did.
void LightStage::State::place(const std::vector<LampTagPose>& tags, bool fresh) {
  if (!tags.empty()) {
    auto known = std::make_shared<Illumination>(*seen);
    tag_matcher.identify(tags, known->lights, known->probe_position_m);
    seen = std::move(known);
  }
  if (dimming && dimming->since_ns != seen->time_ns) dimming.reset();
  LampTagMatcher::Result found =
      tag_matcher.place(*seen, tags, [this](int tag) { return tracker.id_of_tag(tag, seen->lights); });
  tag_warnings = std::move(found.warnings);
  if (!fresh && last && same_places(found.lights, placed)) return;
  placed = std::move(found.lights);
  auto now = std::make_shared<Illumination>(*seen);
  now->lights = placed;
  if (dimming) dim(*dimming, *now);
  now->version = ++version;
  last = std::move(now);
}

void LightStage::resolve(const SeenByColor& light) {
  State& s = *state_;
  if (light.dimming) {
    s.dimming = changes_anything(*light.dimming) ? light.dimming : std::nullopt;
    s.dimming_is_new = true;
  }
  const auto among = [](const std::vector<int>& ids, const PointLight& lamp) {
    return lamp.hidden > 0 && std::find(ids.begin(), ids.end(), lamp.id) != ids.end();
  };
  if (!s.seen || std::none_of(s.seen->lights.begin(), s.seen->lights.end(),
                              [&](const PointLight& lamp) { return among(light.off, lamp) || among(light.lit, lamp); }))
    return;
  auto now = std::make_shared<Illumination>(*s.seen);
  std::erase_if(now->lights, [&](const PointLight& lamp) { return among(light.off, lamp); });
  for (PointLight& lamp : now->lights) {
    if (among(light.lit, lamp)) lamp.hidden = 1;
  }
  s.seen = std::move(now);
}

LightStage::Result LightStage::extract(const capture::FisheyeFrames& fisheye, const capture::Frame* color,
                                       const std::vector<LampTagPose>& tags, float color_gain) {
  State& s = *state_;
  Result result;
  bool fresh = false;  // a new image was evaluated
  const bool at_rest = s.seen && std::none_of(s.seen->lights.begin(), s.seen->lights.end(),
                                              [](const PointLight& light) { return light.hidden > 0; });
  const bool repeated = same_content(fisheye, s.last_frames);
  if (s.camera && !fisheye.empty() && !(at_rest && repeated)) {
    capture::RadianceImage picture = capture::merge_bracket(fisheye, s.camera->response);
    if (picture.radiance.width == s.view.width && picture.radiance.height == s.view.height) {
      if (fisheye.front()->radiance.empty()) {  // else vignetting is removed already
        capture::undo_vignetting(picture, s.vignetting_gain);
      }
      std::optional<float> room_radiance = median_radiance(color, s.color_response);
      if (room_radiance) *room_radiance /= color_gain;
      const OcclusionCheck::Finding finding =
          s.occlusion.check(flux_of(picture.radiance, s.view), room_radiance, picture.clipped_fraction > 0);
      if (finding.covered) {
        result.warnings.push_back(finding.warning);
      } else {
        s.level_warning = finding.warning;
        auto now = std::make_shared<Illumination>(s.illuminate(picture));
        s.tag_matcher.identify(tags, now->lights, now->probe_position_m);
        s.tracker.update(s.seen.get(), *now);
        now->time_ns = repeated && s.seen ? s.seen->time_ns : fisheye.front()->stamp.time_ns;
        s.seen = std::move(now);
        fresh = true;
        s.last_frames = fisheye;
      }
    } else {
      result.warnings.push_back("the fish-eye picture is not of the size of its camera: skipped");
    }
  }
  if (s.seen) s.place(tags, std::exchange(s.dimming_is_new, false) || fresh);
  result.illumination = s.last;
  if (!s.last) {
    result.warnings.push_back(kLightUnknown);
    return result;
  }
  const std::string level_warning = result.warnings.empty() ? s.level_warning : "";
  result.warnings.insert(result.warnings.end(), s.tag_warnings.begin(), s.tag_warnings.end());
  for (const std::string& warning : {level_warning, hidden_warning(*s.last), clipped_warning(*s.last)}) {
    if (!warning.empty()) result.warnings.push_back(warning);
  }
  return result;
}

double relative_change(const Illumination& now, const Illumination& before) {
  double change = 0, sum = 0;
  for (const PointLight& lamp : now.lights) {
    const PointLight* was = lamp_with_id(before.lights, lamp.id);
    const Eigen::Matrix3f a = irradiance_vectors(&lamp), b = irradiance_vectors(was);
    change += (a - b).colwise().norm().sum();
    sum += std::max(a.colwise().norm().sum(), b.colwise().norm().sum());
  }
  for (const PointLight& lamp : before.lights) {
    if (lamp_with_id(now.lights, lamp.id)) continue;
    change += lamp.irradiance.sum();
    sum += lamp.irradiance.sum();
  }
  constexpr int kAxes = 6;
  for (int i = 0; i < kAxes; ++i) {
    const Vector3f normal = (i < 3 ? 1.0f : -1.0f) * Vector3f::Unit(i % 3);
    const Vector3f a = sh_irradiance(now.environment_sh, normal), b = sh_irradiance(before.environment_sh, normal);
    change += (a - b).cwiseAbs().sum() / kAxes;
    sum += std::max(a.sum(), b.sum()) / kAxes;
  }
  return sum > 0 ? change / sum : 0;
}

}  // namespace lumigraft::reconstruct
