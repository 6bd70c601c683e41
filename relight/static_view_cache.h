#pragma once
// What a camera that stands still shows again, so that it need not be worked out again.
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"

namespace lumigraft::relight {

class StaticViewCache {
 public:
  /// A camera that moves the picture by less stands still. Objects are drawn with two samples a pixel or more along
  /// each axis, so a silhouette that is off by this changes the coverage of a pixel by less than one sample does.
  static constexpr double kStill_px = 0.125;

  explicit StaticViewCache(const capture::CameraModel& camera) : camera_(camera) {}

  /// The pose to draw with: the one of before, while nothing that is `nearest_m` away or more moves by kStill_px in the
  /// picture. `moved` says whether it is another than before.
  const Eigen::Isometry3d& hold(const Eigen::Isometry3d& T_tag_camera, double nearest_m, bool* moved);

  /// Blocks of kTile_px that do not show what they showed when they were last taken, and takes these: where surfaces
  /// lie elsewhere by more than a depth camera's noise, or colours differ by more than a colour camera's. Of a block
  /// every second pixel along each axis is looked at, and two must differ. `depth_m` null: none. `all`: takes every
  /// block. `least_m`: a change of depth that is none at any distance.
  std::vector<char> changed_tiles(const capture::Image<std::uint8_t>& codes, const capture::Image<float>* depth_m,
                                  float least_m, bool all);

 private:
  capture::CameraModel camera_;
  Eigen::Isometry3d held_ = Eigen::Isometry3d::Identity();
  bool any_ = false;
  std::vector<float> depth_m_;       // of every second pixel, as taken; 0: none
  std::vector<std::uint8_t> codes_;  // the same, of the brightest channel
};

}  // namespace lumigraft::relight
