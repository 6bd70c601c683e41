// Update of bricks from a depth image.
#include "reconstruct/fusion/brick_update.h"

#include <gtest/gtest.h>

#include <tuple>

#include "reconstruct/fusion/update_schedule.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kVoxelM = 0.008f, kTruncationM = 0.032f;

WorkingBrick new_brick(const BrickKey& key) {
  WorkingBrick brick;
  brick.key = key;
  brick.now = std::make_shared<FieldBrick>();
  return brick;
}

TEST(FusionUpdate, IsBitIdenticalWithNarrowVectors) {
  const capture::CameraModel camera = test::coarse_camera();
  const PixelMap map(camera);
  DepthPreprocessor preprocessor(camera, kVoxelM, kTruncationM, 5), narrow(camera, kVoxelM, kTruncationM, 5, false);
  RecentBricks known;
  std::vector<WorkingBrick> wide_bricks, narrow_bricks;
  const FieldBrickMaker maker;
  for (unsigned i = 0; i < 3; ++i) {
    const Eigen::Isometry3d T_tag_camera = test::looking_at_tag(0.8 + 0.05 * i, 50 * test::kDegree, -2.4 + 0.1 * i);
    const capture::FrameSet frame = test::frame_of(test::ball_on_table, camera, T_tag_camera, i, {1, i + 1});
    PreparedDepth view;
    preprocessor.prepare(frame.depth->depth_m, view);
    PreparedDepth narrow_view;
    narrow.prepare(frame.depth->depth_m, narrow_view);
    for (std::size_t k = 0; k < view.blocks.size(); ++k) {
      const PreparedDepth::Block &a = view.blocks[k], &b = narrow_view.blocks[k];
      EXPECT_EQ(a.normal, b.normal);
      EXPECT_EQ(std::tie(a.distance_m, a.weight, a.facing, a.jump), std::tie(b.distance_m, b.weight, b.facing, b.jump));
      for (int c = 0; c < 4; ++c) EXPECT_EQ(view.planes[k][c], narrow_view.planes[k][c]);
      EXPECT_EQ(view.plane_weights[k], narrow_view.plane_weights[k]);
    }
    const Eigen::Isometry3f T_camera_tag = T_tag_camera.inverse().cast<float>();
    const ColorLookup colour(frame.color.get(), capture::Response::srgb(), camera.width, camera.height);
    for (const BrickKey& key : bricks_on_surfaces(view, preprocessor, T_tag_camera.cast<float>(), kVoxelM, kTruncationM,
                                                  ImageSubset{}, {0, 5}, known)) {
      wide_bricks.push_back(new_brick(key));
      narrow_bricks.push_back(new_brick(key));
    }
    const BrickUpdate::Sizes sizes{kVoxelM, kTruncationM, 64};
    const BrickUpdate by_eight(view, preprocessor, map, colour, T_camera_tag, sizes);
    const BrickUpdate by_four(view, preprocessor, map, colour, T_camera_tag, sizes, false);
    for (std::size_t k = 0; k < wide_bricks.size(); ++k) {
      const auto a = by_eight.update(wide_bricks[k], 5, maker);
      const auto b = by_four.update(narrow_bricks[k], 5, maker);
      EXPECT_EQ(a.new_voxels, b.new_voxels);
      EXPECT_EQ(a.moved_voxels, b.moved_voxels);
      EXPECT_EQ(wide_bricks[k].now->distance_m, narrow_bricks[k].now->distance_m);
      EXPECT_EQ(wide_bricks[k].now->weight, narrow_bricks[k].now->weight);
      ASSERT_EQ(wide_bricks[k].now->color != nullptr, narrow_bricks[k].now->color != nullptr);
      if (!wide_bricks[k].now->color) continue;
      EXPECT_EQ(wide_bricks[k].now->color->radiance, narrow_bricks[k].now->color->radiance);
    }
  }
  EXPECT_GT(wide_bricks.size(), 100u);
}

// What counts as hidden is not observed, at jumps and outside the image too, and little else is updated in vain.
TEST(FusionUpdate, NothingThatIsObservedCountsAsHidden) {
  const capture::CameraModel camera = test::coarse_camera();
  const PixelMap map(camera);
  DepthPreprocessor preprocessor(camera, kVoxelM, kTruncationM, 5);
  RecentBricks known;
  std::vector<BrickKey> keys;
  const FieldBrickMaker maker;
  int hidden = 0, observed = 0, in_vain = 0, lost_voxels = 0, voxels = 0;
  for (unsigned i = 0; i < 4; ++i) {
    const Eigen::Isometry3d T_tag_camera = test::looking_at_tag(0.8, (30 + 15 * i) * test::kDegree, -2.4 + 0.7 * i);
    const capture::FrameSet frame = test::frame_of(test::ball_on_table, camera, T_tag_camera, i, {1, i + 1});
    PreparedDepth view;
    preprocessor.prepare(frame.depth->depth_m, view);
    const Eigen::Isometry3f T_camera_tag = T_tag_camera.inverse().cast<float>();
    const ColorLookup colour(nullptr, capture::Response::srgb(), camera.width, camera.height);
    const BrickUpdate update(view, preprocessor, map, colour, T_camera_tag, {kVoxelM, kTruncationM, 64});
    for (const BrickKey& key : bricks_on_surfaces(view, preprocessor, T_tag_camera.cast<float>(), kVoxelM, kTruncationM,
                                                  ImageSubset{}, {0, 5}, known))
      keys.push_back(key);
    for (const BrickKey& key : keys) {
      const BrickVisibility visibility =
          brick_visibility(key, view, map, static_cast<float>(camera.fx), T_camera_tag, kVoxelM, kTruncationM);
      WorkingBrick all = new_brick(key), visible = new_brick(key);
      const int all_voxels = update.update(all, 1e9f, maker).new_voxels;
      const bool is_hidden = visibility.kind == BrickVisibility::Kind::hidden;
      const int seen_voxels = is_hidden ? 0 : update.update(visible, visibility.hidden_m, maker).new_voxels;
      voxels += all_voxels;
      lost_voxels += all_voxels - seen_voxels;
      ++(is_hidden ? hidden : seen_voxels > 0 ? observed : in_vain);
    }
  }
  EXPECT_LE(lost_voxels, voxels / 10000);
  EXPECT_GT(hidden, in_vain) << "bricks that are recognized as hidden, and those that are updated without need";
  EXPECT_GT(observed, hidden + in_vain);
}

TEST(FusionUpdate, ABrickOfWhichNothingIsObservedIsNotCopied) {
  const capture::CameraModel camera = test::coarse_camera();
  const PixelMap map(camera);
  DepthPreprocessor preprocessor(camera, kVoxelM, kTruncationM, 5);
  const Eigen::Isometry3d T_tag_camera = test::looking_at_tag(0.8, 50 * test::kDegree, -2.4);
  const capture::FrameSet frame = test::frame_of(test::ball_on_table, camera, T_tag_camera, 0, {1, 1});
  PreparedDepth view;
  preprocessor.prepare(frame.depth->depth_m, view);
  const Eigen::Isometry3f T_camera_tag = T_tag_camera.inverse().cast<float>();
  const ColorLookup colour(frame.color.get(), capture::Response::srgb(), camera.width, camera.height);
  const BrickUpdate update(view, preprocessor, map, colour, T_camera_tag, {kVoxelM, kTruncationM, 64});
  const FieldBrickMaker maker;
  WorkingBrick below_table = new_brick({0, 0, -4}), on_table = new_brick({0, 0, 0});
  below_table.publish(below_table.now);
  on_table.publish(on_table.now);
  EXPECT_FALSE(update.update(below_table, 1e9f, maker).observed);
  EXPECT_EQ(below_table.now, below_table.published);
  EXPECT_TRUE(update.update(on_table, 1e9f, maker).observed);
  EXPECT_NE(on_table.now, on_table.published) << "a published brick never changes";
}

// When a frame has more bricks than it may update, those wait that lately were hidden where the image should show them.
TEST(FusionUpdate, WhatWasHiddenLatelyWaits) {
  std::vector<WorkingBrick> bricks(kUpdateSchedule.max_bricks + 1);
  std::vector<VisibleBrick> visible;
  for (WorkingBrick& brick : bricks) {
    brick.update_count = 3;
    visible.push_back({&brick, {BrickVisibility::Kind::surface, 1}});
  }
  bricks[7].misses = 1;
  EXPECT_TRUE(limit_work(visible, 8, 0, kUpdateSchedule.max_bricks));
  EXPECT_EQ(visible.size(), kUpdateSchedule.max_bricks);
  for (const VisibleBrick& kept : visible) EXPECT_NE(kept.brick, &bricks[7]);
}

// Of the others those wait that do not contain the observed surface, unless the image sees through what they contain.
TEST(FusionUpdate, WhatContainsASurfaceIsUpdatedFirst) {
  std::vector<WorkingBrick> bricks(100);
  std::vector<VisibleBrick> visible;
  for (WorkingBrick& brick : bricks) {
    brick.update_count = 3;
    visible.push_back({&brick, {BrickVisibility::Kind::surface, 1}});
    visible.back().visibility.surface_offset = 1.5f;
  }
  visible[10].visibility.surface_offset = 0.5f;
  visible[20].visibility.surface_offset = -0.5f;
  visible[30].visibility.surface_offset = 3;
  bricks[30].solid = true;
  bricks[40].solid = true;  // next to the surface, which its voxels may be behind of
  EXPECT_TRUE(limit_work(visible, 8, 0, 3));
  ASSERT_EQ(visible.size(), 3u);
  EXPECT_EQ(visible[0].brick, &bricks[10]);
  EXPECT_EQ(visible[1].brick, &bricks[20]);
  EXPECT_EQ(visible[2].brick, &bricks[30]);
}

// A camera above a plane: a brick's offset is its height above the plane, relative to half of its edge.
TEST(FusionUpdate, OffsetFromTheObservedSurface) {
  const capture::CameraModel camera = test::coarse_camera();
  DepthPreprocessor preprocessor(camera, kVoxelM, kTruncationM, 5);
  const Eigen::Isometry3d T_tag_camera = test::looking_at_tag(0.8, 0, 0);
  const test::Shape plane = [](const Eigen::Vector3d& p) { return p.z(); };
  const capture::FrameSet frame = test::frame_of(plane, camera, T_tag_camera, 0, {0, 1});
  PreparedDepth view;
  preprocessor.prepare(frame.depth->depth_m, view);
  for (int z = -1; z < 4; ++z) {
    const BrickVisibility visibility =
        brick_visibility({0, 0, z}, view, PixelMap(camera), static_cast<float>(camera.fx),
                         T_tag_camera.inverse().cast<float>(), kVoxelM, kTruncationM);
    EXPECT_NEAR(visibility.surface_offset, (8.0f * static_cast<float>(z) + 3.5f) / 4, 0.05f) << z;
  }
}

// Whether something in a brick is solid is known from its voxels.
TEST(FusionUpdate, ABrickIsSolidWhereAVoxelIsBehindASurface) {
  const capture::CameraModel camera = test::coarse_camera();
  DepthPreprocessor preprocessor(camera, kVoxelM, kTruncationM, 5);
  const Eigen::Isometry3d T_tag_camera = test::looking_at_tag(0.8, 0, 0);
  const test::Shape plane = [](const Eigen::Vector3d& p) { return p.z() - 0.1; };
  const capture::FrameSet frame = test::frame_of(plane, camera, T_tag_camera, 0, {0, 1});
  PreparedDepth view;
  preprocessor.prepare(frame.depth->depth_m, view);
  const PixelMap map(camera);
  const ColorLookup colour(nullptr, capture::Response::srgb(), camera.width, camera.height);
  const Eigen::Isometry3f T_camera_tag = T_tag_camera.inverse().cast<float>();
  const BrickUpdate update(view, preprocessor, map, colour, T_camera_tag, {kVoxelM, kTruncationM, 64});
  const FieldBrickMaker maker;
  WorkingBrick at_surface = new_brick({0, 0, 1}), in_front = new_brick({0, 0, 2});
  const BrickUpdate::Change change = update.update(at_surface, 1e9f, maker);
  EXPECT_TRUE(change.solid);
  const BrickUpdate::Change free = update.update(in_front, 1e9f, maker);
  EXPECT_FALSE(free.solid);
  EXPECT_EQ(free.rows, kBrickEdge * kBrickEdge);
}

TEST(RecentBricks, EachIsInsertedOnceNearAndFar) {
  RecentBricks bricks;
  for (const int far : {0, -64, 63, 64, -1000, 100000}) {
    const BrickKey key{far, 3, -far};
    EXPECT_TRUE(bricks.insert(key)) << far;
    EXPECT_FALSE(bricks.insert(key)) << far;
    EXPECT_FALSE(bricks.contains(Simd4Int{far + 1, 3, -far, 0})) << far;
  }
  EXPECT_TRUE(bricks.contains(Simd4Int{63, 3, -63, 0}));
  EXPECT_FALSE(bricks.contains(Simd4Int{64, 3, -64, 0})) << "contains() is false for bricks outside the bit table";
}

TEST(RecentBricks, AnErasedBrickIsInsertedAgain) {
  RecentBricks bricks;
  for (const BrickKey& key : {BrickKey{1, 2, 3}, BrickKey{1000, 2, 3}}) {
    bricks.insert(key);
    bricks.erase(key);
    EXPECT_TRUE(bricks.insert(key)) << key[0];
  }
}

TEST(RecentBricks, ContainsAllOnlyAfterEachWasInserted) {
  RecentBricks bricks;
  const Simd4Int low{-1, 7, 20, 0}, high{0, 8, 21, 0};
  for (int i = 0; i < 8; ++i) {
    EXPECT_FALSE(bricks.contains_all(low, high)) << i;
    bricks.insert({low[0] + (i & 1), low[1] + (i >> 1 & 1), low[2] + (i >> 2)});
  }
  EXPECT_TRUE(bricks.contains_all(low, high));
  EXPECT_TRUE(bricks.contains_all(low, low));
  EXPECT_FALSE(bricks.contains_all(high, high + Simd4Int{1, 0, 0, 0}));
}

// The upper bound of drift: a brick below it has not drifted in the exact comparison.
TEST(FusionUpdate, TheBoundOfDriftHolds) {
  const capture::CameraModel camera = test::coarse_camera();
  const PixelMap map(camera);
  DepthPreprocessor preprocessor(camera, kVoxelM, kTruncationM, 5);
  RecentBricks known;
  std::vector<WorkingBrick> bricks;
  const FieldBrickMaker maker;
  int skipped = 0, compared = 0, published = 0;
  for (unsigned i = 0; i < 32; ++i) {
    // A lamp becomes brighter after everything has settled.
    const Eigen::Isometry3d T_tag_camera = test::looking_at_tag(0.8, 50 * test::kDegree, -2.4 + 0.002 * i);
    capture::FrameSet frame = test::frame_of(test::ball_on_table, camera, T_tag_camera, i, {1, i + 1});
    if (i > 26) {
      auto brighter = std::make_shared<capture::Frame>(*frame.color);
      for (std::uint8_t& value : brighter->encoded.data) value = static_cast<std::uint8_t>(std::min(255, value + 8));
      frame.color = brighter;
    }
    PreparedDepth view;
    preprocessor.prepare(frame.depth->depth_m, view);
    const Eigen::Isometry3f T_camera_tag = T_tag_camera.inverse().cast<float>();
    const ColorLookup colour(frame.color.get(), capture::Response::srgb(), camera.width, camera.height);
    for (const BrickKey& key : bricks_on_surfaces(view, preprocessor, T_tag_camera.cast<float>(), kVoxelM, kTruncationM,
                                                  ImageSubset{}, {0, 5}, known))
      bricks.push_back(new_brick(key));
    const BrickUpdate update(view, preprocessor, map, colour, T_camera_tag, {kVoxelM, kTruncationM, 64});
    for (WorkingBrick& brick : bricks) {
      const BrickUpdate::Change change = update.update(brick, 5, maker);
      brick.add_drift(change.new_voxels > 0 || change.new_color, change.drift, change.radiance_drift);
      if (!brick.may_have_drifted()) {
        ++skipped;
        EXPECT_FALSE(WorkingBrick(brick).drifted(*brick.now, kVoxelM)) << i;
        continue;
      }
      ++compared;
      if (!brick.drifted(*brick.now, kVoxelM)) continue;
      ++published;
      brick.publish(std::make_shared<FieldBrick>(*brick.now));
    }
  }
  EXPECT_GT(skipped, compared / 4);
  EXPECT_GT(published, 500);
}

}  // namespace
}  // namespace lumigraft::reconstruct
