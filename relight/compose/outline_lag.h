#pragma once
// Depth and colour cameras expose at different times: the outline of what moves is displaced between them.
#include <opencv2/core.hpp>

#include "reconstruct/math/simd4.h"
#include "relight/compose/current_depth.h"
#include "relight/compose/outline_distance.h"

namespace lumigraft::relight {

/// Depth where the colour image shows it.
struct DisplacedDepth {
  const CurrentDepth& depth;
  cv::Point by{0, 0};  ///< displacement, pixels

  float at(int u, int v) const { return inside(u, v) ? depth.at(u - by.x, v - by.y) : 0; }
  bool known(int u, int v) const { return inside(u, v) && depth.known(u - by.x, v - by.y); }
  bool nearer(int u, int v, float limit_m) const { return inside(u, v) && depth.nearer(u - by.x, v - by.y, limit_m); }
  /// False only where it is unknown or not nearer.
  bool maybe_nearer(int u, int v, float limit_m) const {
    if (!inside(u, v)) return false;
    const float z_m = depth.along_z_m().at(u - by.x, v - by.y);
    return z_m > 0 && z_m < limit_m;
  }
  /// False only where that holds for all of kLanes pixels from (u, v) on. A limit of 0: none is nearer.
  static constexpr int kLanes = 4;
  bool any_nearer(int u, int v, reconstruct::Simd4 limits_m) const {
    if (!inside(u, v) || !inside(u + kLanes - 1, v)) return true;
    const reconstruct::Simd4 z_m = reconstruct::load(&depth.along_z_m().at(u - by.x, v - by.y));
    return reconstruct::any((z_m > 0) & (z_m < limits_m));
  }
  /// In a window of the picture, along z; 0: unknown.
  cv::Mat1f within(const cv::Rect& window) const;

 private:
  bool inside(int u, int v) const {
    const int x = u - by.x, y = v - by.y;
    return x >= 0 && y >= 0 && x < depth.along_z_m().width && y < depth.along_z_m().height;
  }
};

/// How far along its normals the outline is searched, pixels, and the distances from it that this needs.
int lag_reach_px(int width);
int lag_distance_px(int width);

/// Displacement in whole pixels that takes an outline of the foreground that depth shows to its place in `picture`,
/// 8-bit sRGB; `away`: the distances from it, exact up to lag_distance_px(), in the window of the picture at `corner`.
/// Along the normals of the outline a step between the colours farther inside and farther outside is fitted (as active
/// contours do, Kass et al. 1988); the displacement has the least robust cost (Geman and McClure 1987) over the steps,
/// and is zero unless that is clearly less.
cv::Point outline_displacement(const capture::Image<std::uint8_t>& picture, const cv::Point& corner,
                               const OutlineDistance& away);

}  // namespace lumigraft::relight
