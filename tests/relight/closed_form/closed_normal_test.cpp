// Normals of real surfaces, used for lamps' light on them.
#include <cmath>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

class ClosedNormal : public ClosedTest {};
ON_BOTH_DEVICES(ClosedNormal);

// A fused floor whose distances have uniform errors of up to half a millimetre per voxel: 0.29 mm RMS. Central
// differences over one voxel would tilt it by 1.1° RMS; over two, by half of that.
TEST_P(ClosedNormal, FloorUnderNoiseStaysFlat) {
  ClosedScene scene;
  const float voxel_m = scene.voxel_m;
  scene.distance = [voxel_m](const Eigen::Vector3f& p) {
    const Eigen::Vector3i at = (p / voxel_m).array().round().matrix().cast<int>();
    auto hash = static_cast<std::uint32_t>(at.x()) * 73856093u ^ static_cast<std::uint32_t>(at.y()) * 19349663u ^
                static_cast<std::uint32_t>(at.z()) * 83492791u;
    hash = (hash ^ hash >> 15) * 0x2c1b3c6du;
    hash = (hash ^ hash >> 12) * 0x297a2d39u;
    return p.z() + 1e-3f * (static_cast<float>(hash >> 8) / 16777216.0f - 0.5f);
  };
  scene.exhibit.objects = {sphere_object(0.08f, {0, 0, 0.1f}, 0.5f)};
  const relight::RelitPicture picture = relit(scene, careful_plan(64, 1));
  double squares = 0;
  int count = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector2f tilt(picture.maps->normals.at(u, v, 0), picture.maps->normals.at(u, v, 1));
      if (picture.maps->mask.at(u, v) > 0 || picture.maps->normals.at(u, v, 2) == 0) continue;
      if (scene.on_plane(u, v).head<2>().norm() > 0.3f) continue;
      squares += tilt.squaredNorm();
      ++count;
    }
  }
  EXPECT_GT(count, 500);
  EXPECT_LT(std::sqrt(squares / count), 0.012);
}

}  // namespace
}  // namespace lumigraft::test
