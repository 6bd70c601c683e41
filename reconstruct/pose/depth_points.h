#pragma once
// Subsampled depth image: points with normals for ICP.
#include <Eigen/Geometry>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/depth_noise.h"
#include "capture/image.h"

namespace lumigraft::reconstruct {

/// Points on a regular grid of pixels.
struct DepthGrid {
  struct Point {
    Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< camera frame, metres; z = 0: no measurement
    Eigen::Vector3f normal =
        Eigen::Vector3f::Zero();  ///< unit, towards the camera; 0 at rims, creases and where unknown
    float sigma_m = 0;            ///< 1σ along the line of sight
  };
  int columns = 0, rows = 0, step = 1;  ///< point (c, r) is at pixel (step c + step / 2, step r + step / 2)
  std::vector<Point> points;

  const Point& at(int column, int row) const { return points[static_cast<std::size_t>(row) * columns + column]; }
};

/// Samples depth images of one camera.
class DepthSampler {
 public:
  explicit DepthSampler(const capture::CameraModel& camera, const capture::DepthNoise& noise = {});

  /// Empty if the image does not have the camera's size.
  DepthGrid sample(const capture::Image<float>& depth_m) const;
  const capture::CameraModel& camera() const { return camera_; }

 private:
  float rim_m(float z) const;  ///< a larger second difference of depth is no surface

  capture::CameraModel camera_;
  capture::DepthNoise noise_;
  int step_ = 1, columns_ = 0, rows_ = 0;
  std::vector<Eigen::Vector2f> rays_;  ///< x/z, y/z; NaN where the lens model has no ray
};

}  // namespace lumigraft::reconstruct
