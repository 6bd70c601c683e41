#pragma once
// Grey regions of a colour image for tag detection and alignment. While a tag is tracked, a small region around it.
#include <Eigen/Core>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/response.h"
#include "capture/frame.h"
#include "reconstruct/pose/rolling_shutter.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

/// A rectangle of pixels inside the image.
struct PixelRegion {
  int left = 0, top = 0, width = 0, height = 0;
};

/// Extends the box from `low` to `high` to multiples of `grid` pixels, and clips it to the image.
PixelRegion region_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int picture_width,
                          int picture_height, int grid = 1);

/// The corners with a margin for the paper that alignment uses, and for the neighbours of its pixels.
PixelRegion region_of_print(const TagCorners& corners, const TagPattern& pattern, int picture_width,
                            int picture_height);

/// Gain from linear radiance to the detector's 8 bits: the brightest 5 % saturate.
float detector_gain(const capture::Image<float>& radiance);

/// Luminance in 8 bits with an sRGB-like curve, for the detector. `gain` applies to radiance images only.
capture::Image<std::uint8_t> detector_codes(const capture::Frame& picture, const PixelRegion& region, float gain);

/// A pixel with its ray and linear light, for alignment.
struct PixelSample {
  int u = 0, v = 0;
  Eigen::Vector2d ray;       ///< x/z, y/z
  Eigen::Vector2d ray_by_u;  ///< derivative of `ray` by the pixel coordinates u, v
  Eigen::Vector2d ray_by_v;
  double light = 0;      ///< linear luminance in any unit
  bool clipped = false;  ///< in some channel: `light` is a lower bound
};

/// Pixels of the region except those on its border, which have no complete neighbourhood. Their rays are those at the
/// time of `motion.row`.
std::vector<PixelSample> sample_pixels(const capture::Frame& picture, const capture::Response& response,
                                       const capture::CameraModel& camera, const PixelRegion& region,
                                       const ImageMotion& motion = {});

/// Every 5th pixel, or every 13th of many (PrintAlignmentParameters), spread evenly over rows and columns.
std::vector<PixelSample> thin_out(const std::vector<PixelSample>& pixels);

}  // namespace lumigraft::reconstruct
