#pragma once
// The camera's pose to render with: the last one, as long as the objects have not moved in the image.
#include <algorithm>
#include <limits>
#include <vector>

#include "relight/gather/parameters.h"
#include "relight/static_view_cache.h"

namespace lumigraft::relight {

class HeldPose {
 public:
  explicit HeldPose(const capture::CameraModel& camera) : view_(camera) {}

  /// `spheres`: around the objects, x, y, z, radius; tag frame.
  const Eigen::Isometry3d& hold(const Eigen::Isometry3d& T_tag_camera, const std::vector<Eigen::Vector4f>& spheres) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector4f& sphere : spheres) {
      const double far_m = (sphere.head<3>().cast<double>() - T_tag_camera.translation()).norm();
      nearest_m = std::min(nearest_m, far_m - static_cast<double>(sphere.w()));
    }
    bool moved = false;
    return view_.hold(T_tag_camera, std::max(nearest_m, kGather.min_nearest_m), &moved);
  }

 private:
  StaticViewCache view_;
};

}  // namespace lumigraft::relight
