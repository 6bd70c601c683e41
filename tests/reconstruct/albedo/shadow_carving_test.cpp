// Occluders inferred from shadows: which voxels become solid, and how they are merged into the field.
#include "reconstruct/albedo/shadow_carving.h"

#include <gtest/gtest.h>

#include "reconstruct/scene_store.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;
using State = ObservedShadow::State;

/// A camera above the floor that looks down; a strip of its image, 0.1 m at the floor, is covered by something at 0.3 m
/// above it.
std::shared_ptr<const SeenSpace> view_with_strip() {
  constexpr int kWidth = 200;
  std::vector<Eigen::Vector2f> rays;
  std::vector<float> inverse;
  for (int v = 0; v < kWidth; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      rays.emplace_back((static_cast<float>(u) - 99.5f) / kWidth, (static_cast<float>(v) - 99.5f) / kWidth);
      inverse.push_back(std::abs(rays.back().x()) < 0.05f ? 1 / 0.7f : 1.0f);
    }
  }
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
  T_tag_camera.linear() << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  T_tag_camera.translation() = Vector3f(0, 0, 1);
  return std::make_shared<const SeenSpace>(rays, inverse, kWidth, T_tag_camera, 0.008f);
}

/// A floor, and a lamp on the right at a slant of 45°. What the strip hides may throw a shadow to the left.
struct Floor {
  TestRoom room;
  DistanceField field;
  PointLight lamp;
  std::vector<SurfaceSample> samples;

  Floor() {
    room.half_m = 0.6f;
    field = room.field();
    field.seen_space = {view_with_strip()};
    lamp.direction = Vector3f(1, 0, 1).normalized();
    for (float x = -0.5f; x < 0.5f; x += 0.04f)
      for (float y = -0.5f; y < 0.5f; y += 0.04f)
        samples.push_back({Vector3f(x, y, 0), Vector3f::UnitZ(), Vector3f::Ones(), 0.04f, 0, 0, true});
  }
  /// Dark from -0.3 to -0.1 m: the shadow of a wall at x = 0 from 0.1 to 0.3 m.
  ObservedShadow shadow(State elsewhere = State::lit) const {
    ObservedShadow result{lamp, {}};
    for (const SurfaceSample& sample : samples) {
      const float x = sample.position.x();
      result.samples.push_back(x > -0.3f && x < -0.1f ? State::dark : elsewhere);
    }
    return result;
  }
  BrickMap<FieldBrick> carve(const std::vector<ObservedShadow>& shadows) const {
    return carve_occluders(field, FieldRays(field), samples, shadows);
  }
};

std::vector<Vector3f> solid_places(const BrickMap<FieldBrick>& bricks, float voxel_m) {
  std::vector<Vector3f> result;
  for (const auto& [key, brick] : bricks)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (brick->weight[static_cast<std::size_t>(i)] > 0 && brick->distance_m[static_cast<std::size_t>(i)] < 0)
        result.push_back(voxel_m * voxel_in(key, i).cast<float>());
  return result;
}

TEST(ShadowCarving, HiddenSpaceThatExplainsAShadowIsSolid) {
  const Floor floor;
  const std::vector<Vector3f> solid = solid_places(floor.carve({floor.shadow()}), floor.field.voxel_m);
  ASSERT_GT(solid.size(), 1000u);
  for (const Vector3f& p : solid) {
    EXPECT_LT(std::abs(p.x()), 0.07f) << "seen through";
    EXPECT_GT(p.z() - p.x(), 0.1f - 0.04f) << "its shadow would be where the floor is lit";
    EXPECT_LT(p.z() - p.x(), 0.3f + 0.04f) << "its shadow would be where the floor is lit";
  }
}

TEST(ShadowCarving, NoShadowOrNothingHiddenCarvesNothing) {
  Floor floor;
  ObservedShadow lit = floor.shadow();
  lit.samples.assign(floor.samples.size(), State::lit);
  EXPECT_TRUE(floor.carve({lit}).empty());
  floor.field.seen_space.clear();
  EXPECT_TRUE(floor.carve({floor.shadow()}).empty()) << "dark paint";
}

TEST(ShadowCarving, LightOfAnotherLampProvesThatSpaceIsFree) {
  const Floor floor;
  PointLight above;
  above.direction = Vector3f::UnitZ();
  const ObservedShadow lit{above, std::vector<State>(floor.samples.size(), State::lit)};
  EXPECT_TRUE(solid_places(floor.carve({floor.shadow(), lit}), floor.field.voxel_m).empty());
}

TEST(OccluderMerge, KeepsWhatWasMeasured) {
  const Floor floor;
  const auto field = std::make_shared<const DistanceField>(floor.field);
  const auto occluders = std::make_shared<const BrickMap<FieldBrick>>(floor.carve({floor.shadow()}));
  OccluderMerge merge;
  const auto merged = merge.merged(field, occluders);
  EXPECT_EQ(merged->version, field->version);
  for (const auto& [key, brick] : merged->bricks) {
    const FieldBrick* before = field->brick(key);
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      const bool known = before && before->weight[i] > 0;
      if (known) {
        EXPECT_EQ(brick->weight[i], before->weight[i]);
        EXPECT_LE(brick->distance_m[i], before->distance_m[i]);
        if (before->distance_m[i] < 0) {
          EXPECT_EQ(brick->distance_m[i], before->distance_m[i]);
        }
      } else if (brick->weight[i] > 0) {
        EXPECT_LT(brick->distance_m[i], field->voxel_m) << "unknown space must stay unknown";
      }
    }
  }
}

TEST(OccluderMerge, WhatDidNotChangeStaysTheSamePointer) {
  const Floor floor;
  const auto field = std::make_shared<const DistanceField>(floor.field);
  const auto none = std::make_shared<const BrickMap<FieldBrick>>();
  const auto occluders = std::make_shared<const BrickMap<FieldBrick>>(floor.carve({floor.shadow()}));
  OccluderMerge merge;
  EXPECT_EQ(merge.merged(field, none), field);
  EXPECT_EQ(merge.merged(nullptr, occluders), nullptr);
  const auto merged = merge.merged(field, occluders);
  EXPECT_EQ(merge.merged(field, occluders), merged);
  auto next = std::make_shared<DistanceField>(*field);
  next->version = 2;
  const auto again = merge.merged(next, occluders);
  EXPECT_EQ(again->version, 2u);
  EXPECT_EQ(again->occluders_version, merged->occluders_version);
  ASSERT_EQ(again->bricks.size(), merged->bricks.size());
  for (const auto& [key, brick] : merged->bricks) EXPECT_EQ(again->bricks.at(key), brick);

  const auto others = std::make_shared<const BrickMap<FieldBrick>>(*occluders);
  EXPECT_NE(merge.merged(next, others)->occluders_version, merged->occluders_version);
  EXPECT_NE(merged->occluders_version, field->occluders_version);
}

TEST(OccluderMerge, StagesGetTheObservedFieldAndRelightTheMerged) {
  const Floor floor;
  const auto field = std::make_shared<const DistanceField>(floor.field);
  SceneStore store;
  store.publish_field(field);
  AlbedoStage::Result solution;
  solution.occluders = std::make_shared<const BrickMap<FieldBrick>>(floor.carve({floor.shadow()}));
  store.publish_solution(solution, field->version, std::make_shared<const Illumination>());
  EXPECT_EQ(store.observed_field(), field);
  const Vector3f from(-0.2f, 0, 0.02f), to = from + 0.8f * floor.lamp.direction;
  EXPECT_TRUE(FieldRays(*store.observed_field()).free(from, to));
  EXPECT_FALSE(FieldRays(*store.newest().field).free(from, to));
}

}  // namespace
}  // namespace lumigraft::reconstruct
