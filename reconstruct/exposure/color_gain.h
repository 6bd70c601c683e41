#pragma once
// Gain of the colour camera: how its exposure and white balance differ, frame by frame, from what the session says.
//
// Surfaces keep their albedo. A place that is seen again should send the radiance that it sent before, times the change
// of irradiance that the fish-eye measured since. What all places have in common beyond that is the camera's:
//
//   log g = median over places of log(pixel value, linear / exposure) - log(L₀ E / E₀)     for each channel
//
// This is relative to the first frames: before something changes, exposure and albedo are not distinguishable. White
// balance, level and vignetting of these follow from places that the fish-eye sees too (camera_match.h).
//
// A lamp that vanished from the fish-eye's image is either covered there or switched off. The same places decide: they
// are predicted under its light and without it, and what fits the frame better is true. Where the fish-eye delivers no
// image and the places contradict its last one, they tell how the light changed since (dimming.h).
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/light/lamp_shadows.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

class ColorGainStage {
 public:
  explicit ColorGainStage(const capture::Session& session);
  ~ColorGainStage();

  struct Result {
    /// Linear pixel value over exposure × radiance, per channel. That of the frame before where this frame does not
    /// determine it: no pose, no depth, too few places seen again, or light that changed in a way nobody measured.
    Eigen::Array3f gain = Eigen::Array3f::Ones();
    std::shared_ptr<const capture::Image<float>> vignetting;  ///< FrameSet::color_vignetting
    /// By how much gain and vignetting are estimated otherwise than before for the same light, as a ratio minus 1: what
    /// was measured with the earlier estimate is wrong by it.
    float correction = 0;
    /// FrameSet::color_shows_room: not if nearly all places that are seen again are too dark, or contradict light that
    /// did not change, in fewer than kExposure.replaced_after frames in a row.
    bool shows_room = true;
    /// Lamps that the fish-eye does not see (PointLight::hidden): those whose light is missing in this frame too are
    /// off, those whose light is still there are lit; of others the frame does not show it.
    SeenByColor light;
    std::shared_ptr<const LampShadows> shadows;  ///< that this frame shows (observed_shadows.h); null: none
    std::vector<std::string> warnings;
  };
  /// `light`: newest known, with distances of lamps where they are known; may be null.
  Result estimate(const capture::FrameSet& frame, const std::optional<Pose>& pose,
                  const std::shared_ptr<const Illumination>& light);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
