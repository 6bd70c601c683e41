#pragma once
// The change of indirect light at pixels: gathered for one of scale² pixels, smoothed over like surfaces (Dammertz et
// al. 2010, edge-avoiding à-trous), brought to every pixel by joint bilateral upsampling (Kopf et al. 2007).
#include "relight/rays/pixel_surfaces.h"
#include "relight/rays/surface_gather.h"

namespace lumigraft::rays {

struct GatherSettings {
  int scale = 2;
  int rays = 16;  ///< of a pixel
  std::uint32_t seed = 0;
};

/// By pixel, signed change of irradiance without what lamps bring themselves, W/m²; 0 where there is no even surface.
std::vector<Rgb> gather_pixels(const DeltaLight& light, const std::vector<reference::Place>& places,
                               const std::vector<PixelSurface>& seen, const CameraModel& camera,
                               const GatherSettings& settings);

/// By pixel, the whole change of radiance that glossy surfaces send to the camera, W/sr/m²; 0 elsewhere.
std::vector<Rgb> gather_gloss(const DeltaLight& light, const std::vector<reference::Place>& places,
                              const std::vector<PixelSurface>& seen, const CameraModel& camera,
                              const GatherSettings& settings);

}  // namespace lumigraft::rays
