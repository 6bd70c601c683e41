#include "reconstruct/light.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "capture/radiance.h"
#include "reconstruct/light_environment.h"
#include "reconstruct/light_split.h"
#include "reconstruct/light_tracking.h"
#include "reconstruct/light_view.h"

namespace lumigraft {
namespace {

// A panel that the probe sees at a slant sends more straight ahead than was seen of it: this cosine bounds how much. As
// relight has it.
constexpr float kLeastSlant = 0.1f;
constexpr int kEnvironmentWidth = 128, kEnvironmentHeight = 64;

using Pictures = std::vector<std::shared_ptr<const Picture>>;

bool same_content(const Pictures& a, const Pictures& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
    return p == q ||
           (p->exposure == q->exposure && p->encoded.data == q->encoded.data && p->radiance.data == q->radiance.data);
  });
}

PointLight point_light(const Lamp& lamp) {
  PointLight light;
  light.direction = lamp.direction;
  light.irradiance = lamp.irradiance;
  const double cosine = 1 - lamp.solid_angle_sr / (2 * std::numbers::pi);
  light.angular_radius_rad = static_cast<float>(std::acos(std::clamp(cosine, -1.0, 1.0)));
  light.clipped = lamp.clipped;
  light.squareness = lamp.squareness;
  light.region = lamp.region;
  return light;
}

std::string clipped_warning(const Illumination& illumination) {
  const auto count = std::count_if(illumination.lights.begin(), illumination.lights.end(),
                                   [](const PointLight& light) { return light.clipped; });
  char line[160];
  std::snprintf(line, sizeof line,
                "%d lamp%s clipped in the fish-eye picture: %s power is a lower bound (%.2f %% of pixels)",
                static_cast<int>(count), count == 1 ? " is" : "s are", count == 1 ? "its" : "their",
                100 * illumination.clipped_fraction);
  return count > 0 ? line : "";
}

}  // namespace

float PointLight::emission(const Eigen::Vector3f& towards) const {
  return flat ? std::max(0.0f, normal.dot(towards)) / std::max(-normal.dot(direction), kLeastSlant) : 1.0f;
}

struct LightStage::State {
  LightSettings settings;
  std::optional<FisheyeCamera> camera;
  FisheyeView view;
  std::optional<EnvironmentResampler> resampler;
  LightTracker tracker;
  Pictures last_pictures;
  std::shared_ptr<const Illumination> last;
  std::uint64_t version = 0;
};

LightStage::LightStage(const Session& session, const LightSettings& settings) : state_(std::make_unique<State>()) {
  state_->settings = settings;
  state_->camera = session.fisheye;
  if (!session.fisheye) return;
  state_->view = fisheye_view(*session.fisheye);
  state_->resampler.emplace(*session.fisheye, state_->view, kEnvironmentWidth, kEnvironmentHeight);
}

LightStage::~LightStage() = default;

LightStage::Result LightStage::extract(const FrameSet& frame) {
  State& s = *state_;
  Result result;
  if (s.camera && !frame.fisheye.empty() && !(s.last && same_content(frame.fisheye, s.last_pictures))) {
    const RadiancePicture picture = merge_bracket(frame.fisheye, s.camera->response);
    if (picture.radiance.width == s.view.width && picture.radiance.height == s.view.height) {
      const LightSplit split = split_lamps(picture.radiance, picture.clipped, s.view, s.settings.max_lights);
      auto now = std::make_shared<Illumination>();
      now->probe_position_m = s.camera->T_tag_fisheye.translation().cast<float>();
      for (const Lamp& lamp : split.lamps) now->lights.push_back(point_light(lamp));
      now->remainder = s.resampler->resample(split.rest, s.view);
      now->remainder_sh = project_sh(now->remainder);
      now->clipped_fraction = picture.clipped_fraction;
      s.tracker.update(s.last.get(), *now);
      now->version = ++s.version;
      s.last = std::move(now);
      s.last_pictures = frame.fisheye;
    } else {
      result.warnings.push_back("the fish-eye picture is not of the size of its camera: skipped");
    }
  }
  result.illumination = s.last;
  if (!s.last) {
    result.warnings.push_back("no fish-eye picture: where light comes from is unknown");
  } else if (const std::string warning = clipped_warning(*s.last); !warning.empty()) {
    result.warnings.push_back(warning);
  }
  return result;
}

void LightStage::reset() {
  state_->tracker.reset();
  state_->last_pictures.clear();
  state_->last.reset();
}

}  // namespace lumigraft
