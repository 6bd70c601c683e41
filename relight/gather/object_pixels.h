#pragma once
// What the camera sees of the objects.
#include "relight/gather/gather_quality.h"
#include "relight/gather/ray_shadows.h"

namespace lumigraft::relight {

/// By pixel of the smallest known window that holds all that shows objects.
struct ObjectPixels {
  int left = 0, top = 0;               ///< of the window, pixels of the picture
  capture::Image<float> radiance;      ///< 3 channels, L_ρ of the share that shows objects, 0 for the rest, W/sr/m²
  capture::Image<float> coverage;      ///< 1 channel, how large that share is
  std::vector<GBufferPixel> surfaces;  ///< what a pixel's first ray found of them
};

/// `room`: what the same camera sees of the room, by pixel of the picture. `last`: of a frame before, for its memory.
ObjectPixels trace_objects(const DeltaLight& light, const std::vector<LightSampleSet>& lamps,
                           const std::vector<GBufferPixel>& room, const CameraRays& eye, const GatherQuality& detail,
                           ObjectPixels last);

}  // namespace lumigraft::relight
