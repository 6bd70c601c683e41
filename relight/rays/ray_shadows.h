#pragma once
// Shadows at pixels: rays to each lamp, smoothed within its penumbra. 4 × 4 pixels share the points of a lamp, which
// are even over it.
#include "relight/rays/delta_light.h"
#include "relight/rays/pixel_surfaces.h"

namespace lumigraft::rays {

/// By pixel, irradiance of all lamps that objects hide from even real surfaces, W/m². `samples`: of a lamp, a power of
/// two.
std::vector<Rgb> hidden_by_objects(const DeltaLight& light, const std::vector<PixelSurface>& seen,
                                   const CameraModel& camera, int samples);

struct LampShare {
  float open = 1;          ///< the share of a lamp's light that comes past room and objects
  bool holds_near = true;  ///< across the pixel: shadows around there are wider than that, or there are none
};
/// By lamp and pixel of an object.
std::vector<std::vector<LampShare>> open_to_lamps(const DeltaLight& light, const std::vector<PixelSurface>& seen,
                                                  const CameraModel& camera, int samples);

}  // namespace lumigraft::rays
