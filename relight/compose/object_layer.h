#pragma once
// The objects as a camera sees them: what every renderer gives to the composer.
#include "capture/image.h"

namespace lumigraft::relight {

/// Of the objects in a window of the image.
struct ObjectLayer {
  int left = 0, top = 0;             ///< of the window, in pixels of the image
  capture::Image<float> radiance;    ///< 3 channels, times coverage, W/sr/m²
  capture::Image<float> coverage;    ///< 1 channel, the fraction of the pixel that shows objects
  capture::Image<float> distance_m;  ///< 1 channel, along the pixel's ray to the object's surface; 0: none
};

}  // namespace lumigraft::relight
