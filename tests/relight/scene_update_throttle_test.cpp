#include "relight/scene_update_throttle.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

namespace lumigraft::relight {
namespace {

reconstruct::Scene scene_of(std::uint64_t version, std::uint64_t occluders_version) {
  auto field = std::make_shared<reconstruct::DistanceField>();
  field->version = version;
  field->occluders_version = occluders_version;
  for (int x = 0; x < 100; ++x) field->bricks[{x, 0, 0}] = nullptr;
  reconstruct::Scene scene;
  scene.field = std::move(field);
  return scene;
}

TEST(SceneUpdateThrottle, FewChangedBricksAreFollowedLater) {
  SceneUpdateThrottle throttle;
  const reconstruct::Scene first = scene_of(100, 0);
  throttle.follow(first);
  EXPECT_EQ(throttle.field(), first.field);
  throttle.follow(scene_of(103, 0));
  EXPECT_EQ(throttle.field(), first.field);
}

// A still camera may publish no further field after occluders were found.
TEST(SceneUpdateThrottle, OccludersAreFollowedAtOnce) {
  SceneUpdateThrottle throttle;
  throttle.follow(scene_of(100, 0));
  const reconstruct::Scene same_field = scene_of(100, 1);
  throttle.follow(same_field);
  EXPECT_EQ(throttle.field(), same_field.field);
  const reconstruct::Scene newer_field = scene_of(103, 2);
  throttle.follow(newer_field);
  EXPECT_EQ(throttle.field(), newer_field.field);
  const reconstruct::Scene without = scene_of(103, 0);
  throttle.follow(without);
  EXPECT_EQ(throttle.field(), without.field);
}

}  // namespace
}  // namespace lumigraft::relight
