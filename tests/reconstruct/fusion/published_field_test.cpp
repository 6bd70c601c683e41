// What is published of the fused field: it never changes, and what did not change is not published again.
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "reconstruct/fusion/fusion.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace test;

TEST(FusionPublished, NothingNewChangesNothing) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  const capture::FrameSet frame = frame_of(ball_on_table, camera, T);
  const auto field = stage.fuse(frame, pose_at(T));
  EXPECT_EQ(stage.fuse(frame, pose_at(T)), field);
  EXPECT_EQ(stage.fuse(frame_of(ball_on_table, camera, T), pose_at(T)), field) << "equal content in another object";

  capture::FrameSet without_depth = frame;
  without_depth.depth = nullptr;
  EXPECT_EQ(stage.fuse(without_depth, pose_at(T)), field);
  Pose old = pose_at(test::looking_at_tag(0.85, 55 * kDegree, -1.3));
  old.age_ns = 1;
  EXPECT_EQ(stage.fuse(frame, old), field) << "a pose that was not measured in this frame";

  EXPECT_EQ(FusionStage(session_with(camera), {}).fuse(without_depth, pose_at(T)), nullptr);
}

TEST(FusionPublished, APublishedFieldNeverChanges) {
  const capture::CameraModel camera = test::small_camera();
  FusionStage stage(session_with(camera), {});
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  const auto field = stage.fuse(frame_of(table, camera, T), pose_at(T));
  std::vector<std::pair<BrickKey, FieldBrick>> copy;
  for (const auto& [key, brick] : field->bricks) copy.emplace_back(key, *brick);
  const auto next = stage.fuse(frame_of(ball_on_table, camera, T, 1), pose_at(T));
  EXPECT_GT(next->version, field->version);
  EXPECT_EQ(copy.size(), field->bricks.size());
  for (const auto& [key, brick] : copy) {
    EXPECT_EQ(field->brick(key)->distance_m, brick.distance_m);
    EXPECT_EQ(field->brick(key)->weight, brick.weight);
  }
}

// Bricks share their colour with what was published of them until it changes.
TEST(FusionPublished, PublishedColoursNeverChange) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  const auto fuse = [&](unsigned i, double radiance, double light_change) {
    const auto light = [radiance](const Vector3d&) { return radiance; };
    return stage.fuse(
        frame_of(table, camera, T, i, {0.1, i + 1}, light), pose_at(T), light_change,
        [&](const Vector3f&) { return Eigen::Array3f::Constant(1 + static_cast<float>(light_change)).eval(); });
  };
  struct Published {
    std::shared_ptr<const DistanceField> field;
    std::vector<std::pair<BrickKey, BrickColor>> colors;
  };
  std::vector<Published> published;
  std::size_t colored = 0, bricks = 0;
  for (unsigned i = 0; i < 12; ++i) {
    const auto field = fuse(i, 0.3 + 0.02 * i, i % 4 == 3 ? 0.2 : 0);
    Published& now = published.emplace_back();
    now.field = field;
    for (const auto& [key, brick] : field->bricks) {
      if (brick->color) now.colors.emplace_back(key, *brick->color);
    }
    bricks = field->bricks.size();
    colored = now.colors.size();
  }
  EXPECT_GT(colored, 100u);
  EXPECT_LT(colored, bricks) << "space without surface has no colour";
  for (const Published& then : published)
    for (const auto& [key, color] : then.colors) {
      EXPECT_EQ(then.field->brick(key)->color->radiance, color.radiance);
      EXPECT_EQ(then.field->brick(key)->color->weight, color.weight);
    }
  const auto first = published.front().field->radiance({0.1f, 0, 0}),
             last = published.back().field->radiance({0.1f, 0, 0});
  ASSERT_TRUE(first && last);
  EXPECT_GT(last->x(), 1.1f * first->x()) << "or nothing changed";
}

TEST(FusionPublished, AConvergedFieldDoesNotChange) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionSettings settings;
  settings.weight_cap = 2;
  FusionStage stage(session_with(camera), settings);
  std::shared_ptr<const DistanceField> field;
  const auto fuse = [&](const Shape& shape, unsigned i) {
    field = stage.fuse(frame_of(shape, camera, T, i, {0.3, i + 1}), pose_at(T));
  };
  for (unsigned i = 0; i < 30; ++i) fuse(table, i);
  std::size_t republished = 0;
  for (unsigned i = 30; i < 50; ++i) {
    const auto before = std::exchange(field, nullptr);
    fuse(table, i);
    for (const auto& [key, brick] : field->bricks) republished += before->brick(key) != brick.get();
  }
  EXPECT_LT(republished, field->bricks.size()) << "less than one brick in twenty per frame";

  // Slow motion is followed: a table that rises by 0.1 mm per frame.
  for (unsigned i = 50; i < 140; ++i) {
    const double rise = 1e-4 * std::min(i - 50, 50u);
    fuse([&](const Vector3d& p) { return p.z() - rise; }, i);
  }
  const auto sample = field->sample(Vector3f(-0.05f, -0.03f, 0.005f));
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->distance_m, 0, 2e-3f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
