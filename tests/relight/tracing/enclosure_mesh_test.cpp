// What no camera saw of a room, as the path-traced reference takes it: its albedo is what the fish-eye saw of it for
// the light that falls there, and where that is no surface's, there is none.
#include "relight/tracing/enclosure_mesh.h"

#include "reconstruct/room/enclosure.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// A box around the fish-eye, as bright everywhere but in the middle of its ceiling, where four of its cells are.
reconstruct::Scene box_with_bright_middle(float times) {
  reconstruct::Scene scene = ClosedScene().scene();
  auto light = std::make_shared<reconstruct::Illumination>(*scene.illumination);
  light->probe_position_m = {0, 0, 0.5f};
  capture::Image<float>& seen = light->environment.radiance;
  seen = capture::Image<float>(512, 256, 3, 1.0f);
  for (int v = 0; v < 28; ++v) {  // less than 20° from the zenith
    for (int u = 0; u < seen.width; ++u) {
      for (int c = 0; c < 3; ++c) seen.at(u, v, c) = times;
    }
  }
  scene.illumination = light;
  auto room = std::make_shared<reconstruct::Enclosure>();
  room->sides = {{Vector3f::UnitZ(), 0, false},  {-Vector3f::UnitZ(), 1, false}, {Vector3f::UnitX(), 1, false},
                 {-Vector3f::UnitX(), 1, false}, {Vector3f::UnitY(), 1, false},  {-Vector3f::UnitY(), 1, false}};
  room->middle_m = light->probe_position_m;
  scene.enclosure = room;
  return scene;
}

/// How many triangles there are, and the albedo of those in the middle of the ceiling.
struct Found {
  std::size_t triangles = 0, in_the_middle = 0;
  float albedo = 0;
};

Found found_with(float times) {
  Found found;
  const auto mesh = relight::enclosure_mesh(box_with_bright_middle(times), {});
  EXPECT_TRUE(mesh);
  if (!mesh) return found;
  const relight::Model& model = *mesh->model;
  for (std::size_t i = 0; i + 2 < model.indices.size(); i += 3) {
    Vector3f middle = Vector3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) middle += model.positions_m[model.indices[i + k]] / 3;
    ++found.triangles;
    if (middle.z() < 0.9f || middle.head<2>().cwiseAbs().maxCoeff() > 0.17f) continue;
    ++found.in_the_middle;
    found.albedo = model.colors[model.indices[i]].x();
  }
  return found;
}

TEST(EnclosureMesh, AlbedoIsWhatIsSeenForTheLightThatFallsThere) {
  const Found grey = found_with(0.4f);
  EXPECT_EQ(grey.in_the_middle, 8U);
  EXPECT_NEAR(grey.albedo, 0.4f, 0.01f);
}

// The albedo of a white wall that is not on the hull is estimated slightly above 1, too; but so is that of a uniform
// sky around a table, and emitters there are not occluded by objects on the table.
TEST(EnclosureMesh, WhatShinesReflectsNothing) {
  for (const float times : {1.15f, 1.5f}) {
    const Found lamp = found_with(times);
    EXPECT_EQ(lamp.in_the_middle, 0U);
    EXPECT_LE(lamp.triangles, (6U * 144 - 4) * 2);
  }
}

}  // namespace
}  // namespace lumigraft::test
