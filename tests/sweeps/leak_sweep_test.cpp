// Light through a partition that is thinner than a voxel.
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class LeakSweep : public SweepTest {};
ON_VULKAN(LeakSweep);

constexpr float kFront_m = -0.124f;  // half a voxel off the field's grid

/// A black ball on one side of a partition, the visible floor on the other.
ClosedScene room_with(float partition_m) {
  ClosedScene scene;
  scene.width = 64;
  scene.height = 48;
  scene.focal_px = 53;
  scene.eye_m = {0, -0.9f, 0.35f};
  scene.look_at_m = {0, -0.3f, 0.05f};
  if (partition_m > 0) {
    const Eigen::AlignedBox3f wall(Eigen::Vector3f(-0.6f, kFront_m - partition_m, -0.1f),
                                   Eigen::Vector3f(0.6f, kFront_m, 0.45f));
    scene.distance = [wall](const Eigen::Vector3f& p) { return std::min(p.z(), box_distance(wall, p)); };
    scene.extent = {Eigen::Vector3f(-0.9f, -0.9f, -0.1f), Eigen::Vector3f(0.9f, 0.9f, 0.5f)};
  }
  scene.exhibit.objects = {sphere_object(0.09f, {0, 0, 0.1f}, 0)};
  return scene;
}

/// Mean change of the floor beyond the partition in pixel values, by the slope of the sRGB curve at the floor's 0.5.
double change_beyond(const ClosedScene& scene, const relight::RelitPicture& picture) {
  const double slope = 255 * 1.055 / 2.4 * std::pow(0.5, 1 / 2.4 - 1);
  double sum = 0;
  int count = 0;
  for_each_floor_pixel(scene, picture, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float) {
    if (p.y() > -0.17f || p.y() < -0.4f || std::abs(p.x()) > 0.2f) return;
    sum += slope * std::abs(delta.x());
    ++count;
  });
  EXPECT_GT(count, 130);
  return sum / std::max(count, 1);
}

// Under a uniform sky nothing that the ball occludes or reflects may arrive beyond the partition, and under a lamp on
// the ball's side the shadow of the partition must not be subtracted twice: the reference is 0. Voxels are 8 mm in the
// room's field and 12.8 mm in the volume around the partition: a wall thinner than a voxel has no interior sample in
// the volume, and one thinner than a voxel of the field is not reconstructed. From one voxel on, leaks must be
// invisible.
TEST_P(LeakSweep, PartitionOfTwoToTwentyMillimetres) {
  Sweep sweep{.stem = "leak-partition",
              .title = "Light through a partition, volume of 13 mm voxels",
              .x_label = "thickness of the partition, mm",
              .y_label = "change of the floor beyond, code values",
              .x = {2, 5, 13, 20},
              .logarithmic = true,
              .max = 1};
  for (const Method& method : methods(64, 1)) {
    for (const bool lamp : {false, true}) {
      if (method.plan.trace_scale == 4 || (lamp && method.plan.method == "dlpv")) continue;  // same cones and lamps
      Curve& curve = sweep.curves.emplace_back(Curve{method.name + (lamp ? ", lamp" : ", sky")});
      const auto measured = [&](float partition_m) {
        ClosedScene scene = room_with(partition_m);
        if (lamp) {
          scene.sky = 0;
          scene.lamps = {lamp_at({0, 0.6f, 0.4f}, 0.01f, 0.5f)};
        }
        return change_beyond(scene, relit(scene, method.plan));
      };
      EXPECT_GT(measured(0), 2);  // the light is blocked by the partition
      for (const double x : sweep.x) curve.y.push_back(measured(1e-3f * static_cast<float>(x)));
    }
  }
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    for (std::size_t i = 0; i < sweep.x.size(); ++i) {
      if (sweep.x[i] < 12.8) continue;
      EXPECT_LT(curve.y[i], sweep.max) << curve.name << ", " << sweep.x[i] << " mm";
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
