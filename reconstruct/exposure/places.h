#pragma once
// Places on surfaces that a colour frame shows, one for each block of the depth image with a known normal.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {

/// Of a cell of kExposure.cell_m in the tag frame: three coordinates and the axis next to the surface's normal.
using CellKey = std::uint64_t;

struct Place {
  CellKey key = 0;
  Eigen::Vector3f position_m, normal;  ///< tag frame
  Eigen::Array3f radiance;             ///< W/sr/m² at gain 1, without vignetting; an upper bound if `dark`
  float corner;                        ///< (θ / θ_corner)², with θ the angle to the optical axis
  bool dark;                           ///< too dark to be measured
};

class PlaceSampler {
 public:
  explicit PlaceSampler(const capture::ColorCamera& camera, const capture::DepthNoise& noise = {});
  /// Of a frame with colour and depth. `vignetting`: factor by pixel, as FrameSet::color_vignetting; may be null.
  std::vector<Place> places(const capture::FrameSet& frame, const Eigen::Isometry3f& T_tag_camera,
                            const capture::Image<float>* vignetting) const;
  /// Points that depth measures, tag frame.
  std::vector<Eigen::Vector3f> surface_m(const capture::DepthFrame& depth, const Eigen::Isometry3f& T_tag_camera) const;
  float corner_rad() const { return corner_rad_; }

 private:
  capture::Response response_;
  float corner_rad_;  ///< θ_corner
  DepthSampler sampler_;
};

}  // namespace lumigraft::reconstruct
