// Difficult scenes and plans: no crash, no NaN or infinity in any map, and a warning where the picture is only
// approximate.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "capture/error.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_shapes.h"
#include "tests/relight/gpu/limited_device.h"

namespace lumigraft::test {
namespace {

/// A device for light volumes of up to 32 voxels per edge and pictures of up to 3000 pixels.
std::shared_ptr<relight::gpu::Device> small_device(std::shared_ptr<relight::gpu::Device> real) {
  return std::make_shared<LimitedDevice>(std::move(real), [](const relight::gpu::TextureDesc& d) {
    const bool of_an_object = d.name.find("object ") == 0;
    return (d.depth <= 64 || of_an_object) && d.width <= 3000;
  });
}

bool all_finite(const relight::RelitPicture& picture) {
  const relight::RelightMaps& maps = *picture.maps;
  for (const capture::Image<float>* map : {&maps.albedo, &maps.normals, &maps.depth_m, &maps.delta, &maps.mask}) {
    if (!std::all_of(map->data.begin(), map->data.end(), [](float x) { return std::isfinite(x); })) return false;
  }
  return true;
}

bool warns_of(const relight::RelitPicture& picture, const std::string& what) {
  return std::any_of(picture.warnings.begin(), picture.warnings.end(),
                     [&](const std::string& warning) { return warning.find(what) != std::string::npos; });
}

/// A furnace: all radiances are equal, so an object that does not absorb is invisible.
ClosedScene furnace() {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 40;
  scene.albedo = 1;
  scene.sky = 0.5f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.5f; };
  return scene;
}

ClosedScene under_a_lamp(const Eigen::Vector3f& position_m, float radius_m) {
  ClosedScene scene = furnace();
  scene.albedo = 0.5f;
  scene.sky = 0.1f;
  const reconstruct::PointLight lamp = lamp_at(position_m, radius_m, 0.3f);
  scene.lamps = {lamp};
  scene.radiance = [lamp](const Eigen::Vector3f& p) {
    return 0.05f + 0.16f * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  return scene;
}

/// Settings that trace per pixel, and those that look up volumes.
std::array<relight::Plan, 2> plans() {
  std::array<relight::Plan, 2> both{careful_plan(32), careful_plan(32)};
  both[1].trace_scale = 4;
  return both;
}

class BadInput : public ClosedTest {
 protected:
  struct Range {
    double min = 0, max = 0;
  };
  /// Relative darkening and brightening of the picture against the furnace's light.
  Range off_the_furnace(const relight::RelitPicture& picture) {
    Range range;
    for (int v = 0; v < picture.srgb.height; ++v) {
      for (int u = 0; u < picture.srgb.width; ++u) {
        if (picture.maps->mask.at(u, v) == 0 && picture.maps->depth_m.at(u, v) <= 0) continue;  // beyond the room
        const double off = picture_radiance(picture, u, v) / 0.5 - 1;
        range.min = std::min(range.min, off);
        range.max = std::max(range.max, off);
      }
    }
    return range;
  }
  void expect_even(const relight::RelitPicture& picture) {
    const double bound = picture.plan.trace_scale == 4 ? 0.12 : 0.07;
    const Range off = off_the_furnace(picture);
    EXPECT_GT(off.min, -bound);
    EXPECT_LT(off.max, bound);
  }
};
ON_BOTH_DEVICES(BadInput);

TEST_P(BadInput, AVolumeThatTheDeviceCannotHoldIsASmallerOne) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.3f)};
  relight::Relighter small(small_device(device_), scene.session());
  for (int turn = 0; turn < 2; ++turn) {
    const relight::RelitPicture picture = scene.relit(small, careful_plan(256));
    EXPECT_EQ(picture.plan.volume, 32);
    EXPECT_TRUE(warns_of(picture, "plan.volume 256 is too large")) << turn;
    EXPECT_EQ(picture.srgb.data, relit(scene, careful_plan(32)).srgb.data);
  }
}

TEST_P(BadInput, APictureThatTheDeviceCannotHoldPassesThrough) {
  ClosedScene scene = furnace();
  scene.width = 3200;
  scene.height = 2;
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.3f)};
  relight::Relighter small(small_device(device_), scene.session());
  const relight::RelitPicture picture = small.relight(scene.frame(), scene.scene(), scene.exhibit, careful_plan(32));
  ASSERT_EQ(picture.srgb.width, 3200);
  EXPECT_NEAR(picture_radiance(picture, 600, 1), 0.5f, 0.01f);
  EXPECT_TRUE(warns_of(picture, "the camera picture passes through"));
}

// A ball with as many triangles as a scan and no shared vertices, which exceeds the buffers of software devices.
TEST_P(BadInput, MillionsOfTriangles) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 1)};
  relight::Model model = model_of(sphere(0.1f, 760));
  ASSERT_GT(model.indices.size() / 3, 2'000'000u);
  scene.exhibit.objects[0].model = std::make_shared<const relight::Model>(std::move(model));
  const relight::RelitPicture picture = relit(scene, plans()[1]);
  EXPECT_TRUE(all_finite(picture));
  if (!warns_of(picture, "is rendered with fewer triangles")) {
    EXPECT_TRUE(picture.warnings.empty());
  }
  expect_even(picture);
}

// A file with a vertex at an invalid position and degenerate triangles, next to a valid square.
TEST_P(BadInput, NanVerticesAndTrianglesOfNoArea) {
  ClosedScene scene = furnace();
  const std::string file = testing::TempDir() + "lumigraft-bad-" + std::string(name_of(GetParam())) + ".ply";
  std::ofstream(file) << "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float "
                         "z\nelement face 5\nproperty list uchar int vertex_indices\nend_header\n-0.1 -0.1 0.1\n0.1 "
                         "-0.1 0.1\n0.1 0.1 0.1\n-0.1 0.1 0.1\nnan 0 0\n0 0 inf\n3 0 1 2\n3 0 2 3\n3 0 1 4\n3 0 1 5\n3 "
                         "1 1 2\n";
  relight::VirtualObject& object = scene.exhibit.objects.emplace_back(sphere_object(0.1f, {0, 0, 0}, 1));
  object.model = relight::load_model(file, 'z');
  for (const relight::Plan& plan : plans()) {
    const relight::RelitPicture picture = relit(scene, plan);
    EXPECT_TRUE(all_finite(picture));
    EXPECT_TRUE(warns_of(picture, "3 triangles without area or finite position are omitted"));
    expect_even(picture);
  }
}

// A lamp inside a ball lights nothing; lamps at its exact centre, on its surface or in the floor cause no failure.
TEST_P(BadInput, ALampInsideTheObject) {
  const Eigen::Vector3f centre(0, 0, 0.15f);
  for (const Eigen::Vector3f& lamp : {Eigen::Vector3f(0.03f, 0.02f, 0.17f), centre}) {
    ClosedScene scene = under_a_lamp(lamp, 0.01f);
    scene.exhibit.objects = {sphere_object(0.1f, centre, 0)};
    for (const relight::Plan& plan : plans()) {
      SCOPED_TRACE(plan.trace_scale);
      const relight::RelitPicture picture = relit(scene, plan);
      EXPECT_TRUE(all_finite(picture));
      EXPECT_TRUE(warns_of(picture, "is within the bounds of object"));
      int floor = 0;
      double left = 0;
      for (int v = 0; v < scene.height; ++v) {
        for (int u = 0; u < scene.width; ++u) {
          const Eigen::Vector3f p = scene.on_plane(u, v);
          if (picture.maps->mask.at(u, v) > 0 || p.norm() > 0.5f) continue;
          ++floor;
          left +=
              std::max(scene.radiance(p) + picture.maps->delta.at(u, v) - 0.05f, 0.0f) / (scene.radiance(p) - 0.05f);
        }
      }
      EXPECT_GT(floor, 200);
      EXPECT_LT(left / floor, plan.trace_scale == 4 ? 0.2 : 0.05);  // with few cones, or many
    }
  }
  for (const Eigen::Vector3f& lamp : {Eigen::Vector3f(0, 0, 0.25f), Eigen::Vector3f(0.2f, 0, 0)}) {
    ClosedScene scene = under_a_lamp(lamp, 0);
    scene.radiance = [](const Eigen::Vector3f&) { return 0.2f; };
    scene.exhibit.objects = {sphere_object(0.1f, centre, 0.5f)};
    EXPECT_TRUE(all_finite(relit(scene, plans()[1])));
  }
}

// Objects out of sight, far outside the known room and far apart: no failure, and where the volumes must cover both, a
// warning gives their resolution.
TEST_P(BadInput, AnObjectOutOfViewOrOfTheRoom) {
  ClosedScene scene = under_a_lamp({0.1f, 0.3f, 0.9f}, 0.02f);
  for (const relight::Plan& plan : plans()) {
    scene.exhibit.objects = {sphere_object(0.1f, {0, -2, 0.3f}, 0.7f)};
    const relight::RelitPicture behind = relit(scene, plan);
    EXPECT_TRUE(all_finite(behind));
    EXPECT_TRUE(behind.warnings.empty());
    scene.exhibit.objects = {sphere_object(0.1f, {0, 40, 0}, 0.7f)};
    EXPECT_TRUE(all_finite(relit(scene, plan)));
    scene.exhibit.objects.push_back(sphere_object(0.1f, {0, 0, 0.12f}, 0.7f));
    const relight::RelitPicture both = relit(scene, plan);
    EXPECT_TRUE(all_finite(both));
    EXPECT_TRUE(warns_of(both, "voxels long"));
  }
}

// The camera inside a white ball, and under a large open shell that intersects the floor.
TEST_P(BadInput, AnObjectAroundTheCamera) {
  ClosedScene scene = furnace();
  for (const relight::Plan& plan : plans()) {
    scene.exhibit.objects = {sphere_object(0.2f, scene.eye_m, 1)};
    const relight::RelitPicture inside = relit(scene, plan);
    EXPECT_TRUE(all_finite(inside));
    EXPECT_TRUE(warns_of(inside, "the camera is within the bounds of object"));
    for (const float covered : inside.maps->mask.data) ASSERT_EQ(covered, 1);
    scene.exhibit.objects = {sphere_object(2, {0, 0, 0}, 1)};
    relight::Model shell = model_of(sphere(2, 20, 0.5f));
    scene.exhibit.objects[0].model = std::make_shared<const relight::Model>(std::move(shell));
    EXPECT_TRUE(all_finite(relit(scene, plan)));
  }
}

// Mirrors and white objects reflect everything: they are invisible in the uniform light. A rough metal loses energy by
// multiple reflections between facets (GGX models one), and gains none.
TEST_P(BadInput, RoughnessZeroAndAlbedoOne) {
  struct Case {
    float metallic, roughness, specular;
  };
  for (const Case& c : {Case{0, 0, 0}, Case{0, 0, 1}, Case{1, 0, 1}, Case{1, 1, 1}}) {
    ClosedScene scene = furnace();
    scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.15f}, 1)};
    relight::MaterialOverride& material = scene.exhibit.objects[0].material;
    material.metallic = c.metallic;
    material.roughness = c.roughness;
    material.specular = c.specular;
    for (const relight::Plan& plan : plans()) {
      SCOPED_TRACE(testing::Message() << "metallic " << c.metallic << ", roughness " << c.roughness << ", specular "
                                      << c.specular << ", 1/" << plan.trace_scale);
      const relight::RelitPicture picture = relit(scene, plan);
      EXPECT_TRUE(all_finite(picture));
      const Range off = off_the_furnace(picture);
      EXPECT_LT(off.max, plan.trace_scale == 4 ? 0.15 : 0.1);
      if (c.metallic == 0 || c.roughness == 0) {
        EXPECT_GT(off.min, plan.trace_scale == 4 ? -0.15 : -0.1);
      }
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
