#pragma once
// Synthetic depth images of a room with closed-form distances.
#include <Eigen/Geometry>

#include "tests/reconstruct/albedo/albedo_room.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::test {

/// A floor with two boxes, which determine all six degrees of freedom of a pose.
inline reconstruct::TestRoom furnished_room() {
  reconstruct::TestRoom room;
  room.half_m = 0.9f;
  room.boxes = {{{-0.45f, 0.2f, -0.1f}, {-0.15f, 0.5f, 0.35f}}, {{0.25f, -0.1f, -0.1f}, {0.5f, 0.4f, 0.2f}}};
  return room;
}

inline capture::DepthFrame depth_of_room(const reconstruct::TestRoom& room, const capture::CameraModel& camera,
                                         const Eigen::Isometry3d& T_tag_camera, unsigned seed, double noise_scale) {
  return depth_picture(camera, T_tag_camera, seed, noise_scale,
                       [&](const Eigen::Vector3d& from, const Eigen::Vector3d& d) {
                         return static_cast<double>(room.along(from.cast<float>(), d.cast<float>()));
                       });
}

}  // namespace lumigraft::test
