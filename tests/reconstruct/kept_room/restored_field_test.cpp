// Fusion that goes on from the surfaces of an earlier run.
#include <gtest/gtest.h>

#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace test;

Isometry3d over_the_table() { return looking_at_tag(0.85, 40 * kDegree, -1.3); }
/// Sees a part of the table that the view above does not.
Isometry3d aside() { return looking_at_tag(0.85, 40 * kDegree, -1.3, {0.9, 0.2, 0}); }

DistanceField without_radiance(const DistanceField& field) {
  DistanceField result = field;
  for (const BrickKey& key : sorted_keys(field.bricks)) {
    auto brick = std::make_shared<FieldBrick>(*field.bricks.at(key));
    brick->color = nullptr;
    result.bricks[key] = brick;
  }
  return result;
}

DistanceField kept_shape(const Shape& shape, const std::vector<Isometry3d>& views) {
  FusionStage stage(session_with(small_camera()), {});
  std::shared_ptr<const DistanceField> field;
  std::uint64_t index = 0;
  for (const Isometry3d& T : views)
    for (int i = 0; i < 6; ++i)
      field =
          fuse_all(stage, frame_of(shape, small_camera(), T, index++, {1, static_cast<unsigned>(index)}), pose_at(T));
  return without_radiance(*field);
}

TEST(RestoredField, KnowsWhatTheCameraHasNotSeenYet) {
  const DistanceField kept = kept_shape(ball_on_table, {over_the_table(), aside()});
  FusionStage cold(session_with(small_camera()), {}), warm(session_with(small_camera()), {});
  warm.restore(kept);
  const capture::FrameSet frame = frame_of(ball_on_table, small_camera(), over_the_table());
  const auto cold_field = cold.fuse(frame, pose_at(over_the_table()));
  const auto warm_field = warm.fuse(frame, pose_at(over_the_table()));
  EXPECT_LT(compare(*cold_field, ball_on_table, small_camera(), aside()).hit_fraction, 0.8) << "or the views overlap";
  const Agreement seen = compare(*warm_field, ball_on_table, small_camera(), aside());
  EXPECT_GT(seen.hit_fraction, 0.98);
  EXPECT_LT(seen.mean_m, 1e-3);
  // What is in view has colours again.
  EXPECT_TRUE(warm_field->radiance({0, 0, 0}));
  EXPECT_FALSE(warm_field->radiance({0.9f, 0.2f, 0}));
}

TEST(RestoredField, OfManyFramesIsMoreExactThanItsFirstFrame) {
  const DistanceField kept = kept_shape(table, std::vector<Isometry3d>(4, over_the_table()));
  FusionStage cold(session_with(small_camera()), {}), warm(session_with(small_camera()), {});
  warm.restore(kept);
  const capture::FrameSet frame = frame_of(table, small_camera(), over_the_table(), 0, {1, 99});
  const auto error = [&](FusionStage& stage) {
    return compare(*stage.fuse(frame, pose_at(over_the_table())), table, small_camera(), over_the_table()).mean_m;
  };
  EXPECT_LT(error(warm), 0.7 * error(cold));
}

TEST(RestoredField, WhatIsGoneDisappears) {
  FusionStage stage(session_with(small_camera()), {});
  stage.restore(kept_shape(ball_on_table, {over_the_table()}));
  std::shared_ptr<const DistanceField> field;
  for (std::uint64_t i = 0; i < 8; ++i)
    field = fuse_all(stage, frame_of(table, small_camera(), over_the_table(), i, {1, static_cast<unsigned>(i + 1)}),
                     pose_at(over_the_table()));
  const Agreement seen = compare(*field, table, small_camera(), over_the_table());
  EXPECT_LT(seen.largest_m, 0.006) << "nothing is left of the ball";
}

// A visitor may hide the room from the first frames.
TEST(RestoredField, LaterFillsOnlyWhatThisRunHasNotObserved) {
  const DistanceField kept = kept_shape(ball_on_table, {over_the_table(), aside()});
  FusionStage stage(session_with(small_camera()), {});
  const auto before = fuse_all(stage, frame_of(table, small_camera(), over_the_table()), pose_at(over_the_table()));
  stage.restore(kept);
  const auto field =
      stage.fuse(frame_of(table, small_camera(), over_the_table(), 1, {1, 7}), pose_at(over_the_table()));
  ASSERT_NE(field, before);
  EXPECT_GT(field->version, before->version);
  EXPECT_GT(compare(*field, table, small_camera(), aside()).hit_fraction, 0.98);
  int observed = 0, filled = 0;
  for (const auto& [key, brick] : before->bricks) {
    const FieldBrick& now = *field->bricks.at(key);
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      if (!(brick->weight[i] > 0)) {
        filled += now.weight[i] > 0 ? 1 : 0;
        continue;
      }
      ++observed;
      // The noise of one more frame; the kept ball would move them by up to a truncation distance.
      ASSERT_NEAR(now.distance_m[i], brick->distance_m[i], 0.006f);
    }
  }
  EXPECT_GT(observed, 100'000);
  EXPECT_GT(filled, 1000);
}

TEST(RestoredField, StaysWithinItsMemoryAndLetsTheViewIn) {
  DistanceField kept = kept_shape(table, {over_the_table()});
  const auto brick = kept.bricks.begin()->second;
  for (int x = 0; x < 60; ++x)
    for (int y = 0; y < 80; ++y)
      for (int z = 100; z < 125; ++z) kept.bricks[{x, y, z}] = brick;  // far from the tag and out of view
  FusionSettings settings;
  settings.max_memory_mb = 300;
  ASSERT_GT(static_cast<double>(kept.bricks.size() * sizeof(FieldBrick)), 1.5e6 * settings.max_memory_mb);
  FusionStage stage(session_with(small_camera()), settings);
  stage.restore(kept);
  std::shared_ptr<const DistanceField> field;
  for (std::uint64_t i = 0; i < 6; ++i) {
    field = fuse_all(stage, frame_of(table, small_camera(), aside(), i, {1, static_cast<unsigned>(i + 1)}),
                     pose_at(aside()));
    EXPECT_LE(stage.memory().used_bytes, 1.02e6 * settings.max_memory_mb) << i;
  }
  EXPECT_GT(compare(*field, table, small_camera(), aside()).hit_fraction, 0.98);
  EXPECT_GT(compare(*field, table, small_camera(), over_the_table()).hit_fraction, 0.98) << "near the tag";
}

TEST(RestoredField, CoarseSurfacesComeBack) {
  const auto room = [](const Vector3d& p) { return std::min(p.z(), 7 - p.y()); };
  const Isometry3d T = looking_at_tag(1, 80 * kDegree, -M_PI / 2, {0, 3, 0.5});
  FusionStage first(session_with(small_camera()), {});
  const capture::FrameSet frame = frame_of(room, small_camera(), T, 0, {}, nullptr, 12);
  const auto known = fuse_all(first, frame, pose_at(T));
  ASSERT_TRUE(known->coarse && !known->coarse->bricks.empty());
  FusionStage second(session_with(small_camera()), {});
  second.restore(without_radiance(*known));
  const capture::FrameSet other = frame_of(table, small_camera(), over_the_table(), 1);
  const auto field = second.fuse(other, pose_at(over_the_table()));
  const auto hit = field->raycast(T.translation().cast<float>(), Vector3f::UnitY(), 0.1f, 12);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->position_m.y(), 7, 0.02);
}

}  // namespace
}  // namespace lumigraft::reconstruct
