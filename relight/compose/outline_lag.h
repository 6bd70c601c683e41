#pragma once
// Depth and colour cameras expose at different times: the outline of what moves is displaced between them.
#include <opencv2/core.hpp>

#include "relight/compose/current_depth.h"

namespace lumigraft::relight {

/// Depth where the colour image shows it.
struct DisplacedDepth {
  const CurrentDepth& depth;
  cv::Point by{0, 0};  ///< displacement, pixels

  float at(int u, int v) const {
    const int x = u - by.x, y = v - by.y;
    return x >= 0 && y >= 0 && x < depth.along_z_m().width && y < depth.along_z_m().height ? depth.at(x, y) : 0;
  }
};

/// Displacement in whole pixels that takes the outline of `front`, not 0 in the foreground that depth shows, to its
/// place in `picture`, 8-bit sRGB; `front` is of the window of the picture at `corner`. Along the normals of the
/// outline a step between the colours farther inside and farther outside is fitted (as active contours do, Kass et al.
/// 1988); the displacement has the least robust cost (Geman and McClure 1987) over the steps, and is zero unless that
/// is clearly less.
cv::Point outline_displacement(const capture::Image<std::uint8_t>& picture, const cv::Point& corner,
                               const cv::Mat1b& front);

}  // namespace lumigraft::relight
