#pragma once
// The parts of a colour picture that pose looks at. While the tag is tracked that is a small region around it.
#include <Eigen/Core>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// A rectangle of pixels, all of them inside the picture.
struct PixelRegion {
  int left = 0, top = 0, width = 0, height = 0;
};

/// Grows the box `low` to `high` to whole pixels and cuts it to the picture. Corners on multiples of `grid`.
PixelRegion region_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int picture_width,
                          int picture_height, int grid = 1);

/// Brings linear radiance to where the detector's 8 bits tell it apart: the brightest 5 % saturate.
float detector_gain(const capture::Image<float>& radiance);

/// Luminance in 8 bits under an sRGB-like curve, for the detector. `gain` counts for radiance pictures alone.
capture::Image<std::uint8_t> detector_codes(const capture::Picture& picture, const PixelRegion& region, float gain);

/// A pixel as geometry needs it.
struct SeenPixel {
  int u = 0, v = 0;
  Eigen::Vector2d ray;       ///< x/z, y/z of its line of sight
  Eigen::Vector2d ray_by_u;  ///< change of that from pixel to pixel
  Eigen::Vector2d ray_by_v;
  double light = 0;  ///< linear luminance in any unit
  bool cut = false;  ///< the picture ends there, in some channel: the light is that or more
};

/// Pixels of the region, but those on its border, whose neighbours are not all known.
std::vector<SeenPixel> seen_pixels(const capture::Picture& picture, const capture::Response& response,
                                   const capture::CameraModel& camera, const PixelRegion& region);

/// Every fifth pixel, or every thirteenth of many, spread evenly over rows and columns.
std::vector<SeenPixel> thinned(const std::vector<SeenPixel>& pixels);

}  // namespace lumigraft::reconstruct
