#pragma once
// Space that this frame's camera sees through: what was fused there is gone.
#include <Eigen/Geometry>
#include <optional>

#include "relight/compose/current_depth.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

class FreeSpace {
 public:
  /// `camera`: whose pixels `depth` has; it must have some.
  FreeSpace(const PosedCamera& camera, const CurrentDepth& depth);

  struct Place {
    int u, v;   ///< nearest pixel
    float z_m;  ///< along the camera's z
  };
  /// Empty outside the image.
  std::optional<Place> place(const Eigen::Vector3f& p_m) const;
  /// Whether depth clearly shows farther surfaces at the point's pixel and around it, as far as fusion displaces edges:
  /// a pixel next to a thin surface, or on one that is seen edge-on, shows what is behind it. `p_m`: tag frame.
  bool contains(const Eigen::Vector3f& p_m) const;
  bool contains(const Place& at) const { return at.z_m < around_z_m_.at(at.u, at.v); }

 private:
  PosedCamera camera_;
  Eigen::Isometry3f T_camera_tag_;
  capture::Image<float> around_z_m_;  ///< nothing around the pixel is nearer; 0: unknown at the pixel
};

}  // namespace lumigraft::relight
