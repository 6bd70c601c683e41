#pragma once
// What the camera sees of the objects.
#include "relight/rays/ray_shadows.h"

namespace lumigraft::rays {

struct ObjectPixels {
  Image<float> radiance;               ///< 3 channels, L_ρ of the share that shows objects, 0 for the rest, W/sr/m²
  Image<float> coverage;               ///< 1 channel, how large that share is
  std::vector<PixelSurface> surfaces;  ///< by pixel, what its first ray found of them
};

/// `room`: what the same camera sees of the room. `step`: as of hidden_by_objects.
ObjectPixels see_objects(const DeltaLight& light, const std::vector<LampPoints>& lamps,
                         const std::vector<PixelSurface>& room, const Eye& eye, int step);

}  // namespace lumigraft::rays
