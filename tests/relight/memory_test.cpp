// Device memory of a renderer: chunks are allocated near surfaces only, so memory grows with surface area.
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// Two walls and a floor, and a shelf next to the objects, at a distance, in an image of 640 × 480.
ClosedScene corner() {
  ClosedScene scene;
  scene.width = 640;
  scene.height = 480;
  scene.focal_px = 500;
  scene.eye_m = {2, -3, 2.5f};
  scene.distance = [](const Eigen::Vector3f& p) {
    const float walls = std::min({p.z(), p.x() + 0.3f, 0.3f - p.y()});
    return std::min(walls,
                    box_distance({Eigen::Vector3f(-0.3f, -0.2f, 0.1f), Eigen::Vector3f(-0.15f, 0.3f, 0.14f)}, p));
  };
  scene.extent = {Eigen::Vector3f(-0.4f, -0.9f, -0.1f), Eigen::Vector3f(0.9f, 0.4f, 0.9f)};
  scene.lamps = {lamp_at({0.5f, -0.5f, 1}, 0.02f, 0.3f)};
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.3f),
                           box_object({-0.1f, -0.3f, 0}, {0.1f, -0.2f, 0.2f}, 0.6f)};
  return scene;
}

class Memory : public testing::TestWithParam<relight::gpu::Backend> {
 protected:
  /// A device of its own: what others held is not counted.
  std::shared_ptr<relight::gpu::Device> device_ = relight::gpu::create_device(GetParam(), {});

  relight::gpu::Holdings held_after(relight::Plan plan) {
    const ClosedScene scene = corner();
    relight::Relighter relighter(device_, scene.session());
    plan.rsm = 64;
    plan.bounces = 1;
    plan.trace_scale = 2;
    const relight::RelitPicture picture = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, plan);
    EXPECT_EQ(picture.plan.volume, plan.volume);
    EXPECT_TRUE(picture.warnings.empty());
    std::string all;
    for (const relight::gpu::Holding& held : device_->holdings().list()) {
      if (held.bytes > 5'000'000) all += held.name + " " + relight::gpu::megabytes_text(held.bytes) + ", ";
    }
    RecordProperty("held", all);
    return device_->holdings();
  }
};
ON_BOTH_DEVICES(Memory);

TEST_P(Memory, VolumesOf256VoxelsFitInto600Megabytes) {
  EXPECT_LT(held_after(careful_plan(256)).max_bytes(), 600'000'000u);
}

// Eight times the voxels, four times the area.
TEST_P(Memory, WhatIsKeptOfSurfacesGrowsWithTheirArea) {
  const auto of_surfaces = [&](int volume) {
    std::size_t bytes = 0;
    for (const relight::gpu::Holding& held : held_after(careful_plan(volume)).list()) {
      for (const char* name : {"real radiance", "real change", "virtual radiance", "real flux", "virtual flux"}) {
        if (held.name == name) bytes += held.bytes;
      }
    }
    return static_cast<double>(bytes);
  };
  const double coarse = of_surfaces(64), fine = of_surfaces(128);
  EXPECT_LT(fine, 5 * coarse);
}

}  // namespace
}  // namespace lumigraft::test
