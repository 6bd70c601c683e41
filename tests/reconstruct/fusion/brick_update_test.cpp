// Update of bricks from a depth image.
#include "reconstruct/fusion/brick_update.h"

#include <gtest/gtest.h>

#include <tuple>

#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kVoxelM = 0.008f, kTruncationM = 0.032f;

capture::CameraModel coarse_camera() {
  capture::CameraModel camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 131;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

WorkingBrick new_brick(const BrickKey& key) {
  WorkingBrick brick;
  brick.key = key;
  brick.now = std::make_shared<FieldBrick>();
  return brick;
}

TEST(FusionUpdate, IsBitIdenticalWithNarrowVectors) {
  const capture::CameraModel camera = coarse_camera();
  const PixelMap map(camera);
  DepthPreprocessor preprocessor(camera, kVoxelM, 5), narrow(camera, kVoxelM, 5, false);
  RecentBricks known;
  std::vector<WorkingBrick> wide_bricks, narrow_bricks;
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
    }
    const Eigen::Isometry3f T_camera_tag = T_tag_camera.inverse().cast<float>();
    const ColorLookup colour(frame.color.get(), capture::Response::srgb(), camera.width, camera.height);
    for (const BrickKey& key : bricks_on_surfaces(view, preprocessor, T_tag_camera.cast<float>(), kVoxelM, kTruncationM,
                                                  ImageSubset{}, known)) {
      wide_bricks.push_back(new_brick(key));
      narrow_bricks.push_back(new_brick(key));
    }
    const BrickUpdate::Sizes sizes{kVoxelM, kTruncationM, 64};
    const BrickUpdate by_eight(view, preprocessor, map, colour, T_camera_tag, sizes);
    const BrickUpdate by_four(view, preprocessor, map, colour, T_camera_tag, sizes, false);
    for (std::size_t k = 0; k < wide_bricks.size(); ++k) {
      const auto a = by_eight.update(wide_bricks[k], 5);
      const auto b = by_four.update(narrow_bricks[k], 5);
      EXPECT_EQ(a.new_voxels, b.new_voxels);
      EXPECT_EQ(a.moved_voxels, b.moved_voxels);
      EXPECT_EQ(wide_bricks[k].now->distance_m, narrow_bricks[k].now->distance_m);
      EXPECT_EQ(wide_bricks[k].now->weight, narrow_bricks[k].now->weight);
      EXPECT_EQ(wide_bricks[k].now->radiance, narrow_bricks[k].now->radiance);
    }
  }
  EXPECT_GT(wide_bricks.size(), 100u);
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
  const capture::CameraModel camera = coarse_camera();
  const PixelMap map(camera);
  DepthPreprocessor preprocessor(camera, kVoxelM, 5);
  RecentBricks known;
  std::vector<WorkingBrick> bricks;
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
                                                  ImageSubset{}, known))
      bricks.push_back(new_brick(key));
    const BrickUpdate update(view, preprocessor, map, colour, T_camera_tag, {kVoxelM, kTruncationM, 64});
    for (WorkingBrick& brick : bricks) {
      const BrickUpdate::Change change = update.update(brick, 5);
      brick.add_drift(change.new_voxels > 0 || change.new_color, change.drift, change.radiance_drift);
      if (!brick.may_have_drifted()) {
        ++skipped;
        EXPECT_FALSE(WorkingBrick(brick).drifted(*brick.now, kVoxelM)) << i;
        continue;
      }
      ++compared;
      if (!brick.drifted(*brick.now, kVoxelM)) continue;
      ++published;
      brick.published = std::make_shared<FieldBrick>(*brick.now);
    }
  }
  EXPECT_GT(skipped, compared / 4);
  EXPECT_GT(published, 500);
}

}  // namespace
}  // namespace lumigraft::reconstruct
