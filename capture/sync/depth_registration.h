#pragma once
// Depth on the depth camera's pixels becomes depth on the colour camera's pixels.
#include <Eigen/Core>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"

namespace lumigraft::capture {

class DepthRegistration {
 public:
  DepthRegistration(const DepthCamera& depth, const CameraModel& color);

  /// Counts of the depth camera to metres along the colour camera's z. Where not registered, every depth pixel is
  /// drawn as the rectangle it covers on the colour picture, the nearest winning, and holes that lie between two
  /// neighbouring measurements (an effect of resampling, not of the sensor) are filled with their mean.
  Image<float> operator()(const Image<std::uint16_t>& counts) const;

 private:
  Image<float> reproject(const Image<std::uint16_t>& counts) const;

  DepthCamera depth_;
  CameraModel color_;
  std::vector<Eigen::Vector3d> rays_;  ///< per depth pixel in the depth frame, z = 1; NaN where the lens sees nothing
};

}  // namespace lumigraft::capture
