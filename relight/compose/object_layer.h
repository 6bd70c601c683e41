#pragma once
// The objects as a camera sees them: what every renderer gives to the composer.
#include <cstddef>
#include <optional>

#include "capture/image.h"

namespace lumigraft::relight {

/// Of the objects in a window of the image.
struct ObjectLayer {
  int left = 0, top = 0;             ///< of the window, in pixels of the image
  capture::Image<float> radiance;    ///< 3 channels, times coverage, W/sr/m²
  capture::Image<float> coverage;    ///< 1 channel, the fraction of the pixel that shows objects
  capture::Image<float> distance_m;  ///< 1 channel, along the pixel's ray to the object's surface; 0: none

  /// Index in `coverage` of a pixel of the image; empty outside the window.
  std::optional<std::size_t> index(int u, int v) const {
    const int x = u - left, y = v - top;
    if (x < 0 || y < 0 || x >= coverage.width || y >= coverage.height) return std::nullopt;
    return coverage.index(x, y);
  }
};

}  // namespace lumigraft::relight
