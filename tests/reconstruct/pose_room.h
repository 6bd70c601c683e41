#pragma once
// What a depth camera sees of a room whose distances are known in closed form.
#include <Eigen/Geometry>
#include <cstdint>
#include <random>

#include "capture/camera_model.h"
#include "capture/frame.h"
#include "tests/reconstruct/albedo_room.h"

namespace lumigraft::test {

/// A floor with two boxes: no direction and no turn leaves it as it is.
inline TestRoom furnished_room() {
  TestRoom room;
  room.half_m = 0.9f;
  room.boxes = {{{-0.45f, 0.2f, -0.1f}, {-0.15f, 0.5f, 0.35f}}, {{0.25f, -0.1f, -0.1f}, {0.5f, 0.4f, 0.2f}}};
  return room;
}

/// Sphere tracing; noise grows with depth as a Kinect's (Nguyen, Izadi & Lovell 2012, eq. 3), `noise_scale` times.
inline DepthPicture depth_of_room(const TestRoom& room, const CameraModel& camera,
                                  const Eigen::Isometry3d& T_tag_camera, unsigned seed, double noise_scale) {
  DepthPicture depth;
  depth.depth_m = Image<float>(camera.width, camera.height, 1);
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      if (!ray) continue;
      const Eigen::Vector3f from = T_tag_camera.translation().cast<float>();
      const Eigen::Vector3f d = (T_tag_camera.linear() * *ray).cast<float>();
      float along = 0, near = 1;
      for (int i = 0; i < 200 && near > 1e-5f && along < 8; ++i) {
        near = room.distance(from + along * d);
        along += near;
      }
      if (near > 1e-3f) continue;
      const double z = static_cast<double>(along) * ray->z();
      depth.depth_m.at(u, v) =
          static_cast<float>(z + noise_scale * (0.0012 + 0.0019 * (z - 0.4) * (z - 0.4)) * gauss(random));
    }
  return depth;
}

}  // namespace lumigraft::test
