#pragma once
// The reconstructed surface as the colour camera sees it, from rays through the distance field. Used by one thread.
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::server {

class SeenSurface {
 public:
  struct Pixel {
    Eigen::Vector3f position_m, normal;  ///< tag frame; normal unit
    float depth_m = 0;                   ///< along the camera's z axis
  };

  /// Casts rays anew where the view or the field changed since the last call.
  void update(const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera,
              std::shared_ptr<const reconstruct::DistanceField> field);

  /// Of the ray that is next to the pixel, which is in the picture. Empty: no surface is known there.
  const std::optional<Pixel>& at(int u, int v) const;

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<std::optional<Pixel>> pixels_;
  Eigen::Isometry3d T_tag_camera_ = Eigen::Isometry3d::Identity();
  std::shared_ptr<const reconstruct::DistanceField> field_;
};

}  // namespace lumigraft::server
