#pragma once
// A depth picture as the few points that pose needs of it.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"

namespace lumigraft::reconstruct {

/// Every so many pixels one point, in rows and columns.
struct DepthGrid {
  struct Point {
    Eigen::Vector3f place = Eigen::Vector3f::Zero();   ///< camera frame, metres; z = 0: nothing measured
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, towards the camera; 0 at rims and where unknown
    float sigma_m = 0;                                 ///< 1σ along the line of sight
  };
  int columns = 0, rows = 0, step = 1;  ///< point (c, r) is that of pixel (step c + step / 2, step r + step / 2)
  std::vector<Point> points;

  const Point& at(int column, int row) const { return points[static_cast<std::size_t>(row) * columns + column]; }
};

class DepthSampler {
 public:
  explicit DepthSampler(const capture::CameraModel& camera);

  /// Empty where the picture is not the camera's.
  DepthGrid sample(const capture::Image<float>& depth_m) const;
  const capture::CameraModel& camera() const { return camera_; }

 private:
  capture::CameraModel camera_;
  int step_ = 1, columns_ = 0, rows_ = 0;
  std::vector<Eigen::Vector2f> rays_;  ///< x/z, y/z; NaN where the camera sees nothing
};

}  // namespace lumigraft::reconstruct
