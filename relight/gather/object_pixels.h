#pragma once
// Radiance and coverage of the objects in the camera view.
#include "relight/gather/current_depth.h"
#include "relight/gather/gather_quality.h"
#include "relight/gather/ray_shadows.h"

namespace lumigraft::relight {

/// Per pixel of the smallest window that contains all pixels showing objects.
struct ObjectPixels {
  int left = 0, top = 0;               ///< of the window, in pixels of the full image
  capture::Image<float> radiance;      ///< 3 channels, L_ρ of the part of the pixel that shows objects, W/sr/m²
  capture::Image<float> coverage;      ///< 1 channel, the fraction of that part
  std::vector<GBufferPixel> surfaces;  ///< object surface at each pixel's first ray
};

/// `room`: the room's G-buffer of the same camera, full image. Where `depth` is clearly before or behind an object, the
/// fused room does not hide it: what is before it is left to foreground_matte.h. `last`: an earlier frame's result,
/// whose memory is reused.
ObjectPixels trace_objects(const DeltaLight& light, const std::vector<LightSampleSet>& lamps,
                           const std::vector<GBufferPixel>& room, const CameraRays& eye, const CurrentDepth& depth,
                           const GatherQuality& detail, ObjectPixels last);

}  // namespace lumigraft::relight
