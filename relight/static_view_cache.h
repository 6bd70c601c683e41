#pragma once
// Detects a static camera and unchanged image blocks, so that their results can be reused.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"

namespace lumigraft::relight {

class StaticViewCache {
 public:
  explicit StaticViewCache(const capture::CameraModel& camera) : camera_(camera) {}

  /// The pose to render with: the previous one as long as no point at `nearest_m` or farther moves by still_px in the
  /// image. `moved`: whether it differs from the previous.
  const Eigen::Isometry3d& hold(const Eigen::Isometry3d& T_tag_camera, double nearest_m, bool* moved);

  /// Blocks of kTile_px whose content differs from when they were last stored; stores these. Changed means: depth
  /// differs by more than a depth camera's noise, or colour by more than a colour camera's, at two or more of the
  /// block's pixels; every second pixel along each axis is compared. `depth_m` null: none. `all`: returns every block.
  /// `min_change_m`: depth changes below this are ignored at any distance.
  std::vector<char> changed_tiles(const capture::Image<std::uint8_t>& codes, const capture::Image<float>* depth_m,
                                  float min_change_m, bool all);

 private:
  capture::CameraModel camera_;
  Eigen::Isometry3d held_ = Eigen::Isometry3d::Identity();
  bool any_ = false;
  std::vector<float> depth_m_;       // every second pixel, as stored; 0: none
  std::vector<std::uint8_t> codes_;  // likewise, the brightest channel
};

}  // namespace lumigraft::relight
