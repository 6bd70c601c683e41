// Tags that are printed or placed wrongly: each is named and none moves the camera in silence.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/pose_room.h"
#include "tests/reconstruct/pose/tag_table.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using test::kFrameNs;
using test::lying_at;

bool names(const PoseStage::Result& result, const std::string& text) {
  return std::ranges::any_of(result.warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

/// Seen in a mirror, or printed mirrored: about the same.
capture::FrameSet mirrored(const capture::FrameSet& frame) {
  capture::FrameSet result = frame;
  capture::Frame picture = *frame.color;
  for (int v = 0; v < picture.encoded.height; ++v)
    for (int u = 0; u < picture.encoded.width; ++u)
      std::copy_n(&frame.color->encoded.at(picture.encoded.width - 1 - u, v), 3, &picture.encoded.at(u, v));
  result.color = std::make_shared<capture::Frame>(std::move(picture));
  return result;
}

TEST(BadTags, ATagThatIsPrintedMirroredIsNamed) {
  PoseStage stage({"tag36h11", 2, 0.16}, test::small_camera());
  test::TagTable table;
  table.second = false;
  const std::string warning = "tag 2: is seen mirrored, and not used";
  for (std::uint64_t i = 0; i < 120; i += 10) {
    const auto result = stage.locate(mirrored(table.seen_from(test::above_the_table(0), i)));
    EXPECT_FALSE(result.pose) << i;
    EXPECT_EQ(names(result, warning), i > 60) << i;  // after two seconds, and as long as it is so
  }
  const auto result = stage.locate(table.seen_from(test::above_the_table(0), 121));
  ASSERT_TRUE(result.pose);
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
}

// A wall that is a mirror: the tag lies in one half of the picture, its reflection in the other.
TEST(BadTags, AMirrorThatShowsTheTagIsNamed) {
  const capture::CameraModel camera = test::small_camera();
  PoseStage stage({"tag36h11", 2, 0.16}, camera);
  test::TagTable table;
  table.second = false;
  const Isometry3d truth = test::looking_at_tag(0.9, 45 * test::kDegree, -90 * test::kDegree, {0.15, 0, 0});
  const capture::FrameSet seen = table.seen_from(truth, 0), reflection = mirrored(seen);
  const double tag_px = camera.project(truth.inverse().translation())->x();
  ASSERT_GT(std::abs(tag_px - camera.cx), 30);
  capture::Frame picture = *seen.color;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      if ((u < camera.cx) != (tag_px < camera.cx))
        std::copy_n(&reflection.color->encoded.at(u, v), 3, &picture.encoded.at(u, v));
  capture::FrameSet frame = seen;
  frame.color = std::make_shared<capture::Frame>(std::move(picture));
  const auto result = stage.locate(frame);
  ASSERT_TRUE(result.pose);
  EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 5);
  const std::string pixel = std::to_string(static_cast<int>(std::lround(camera.width - 1 - tag_px)));
  EXPECT_TRUE(names(result, "a mirror shows tag 2 at pixel (" + pixel)) << result.warnings.size();
}

// The right one of two tags with one number is covered: depth shows that the camera rests.
TEST(BadTags, TheOtherTagOfOneNumberMovesNoCamera) {
  const capture::CameraModel camera = test::small_camera();
  const TestRoom room = test::furnished_room();
  const DistanceField field = room.field();
  PoseStage stage({"tag36h11", 2, 0.16}, camera);
  test::TagTable table;
  table.second_id = 2;
  const Isometry3d truth = test::above_the_table(0);
  for (std::uint64_t i = 0; i < 60; ++i) {
    table.second = i >= 10;  // someone lays a second one down
    table.first = i < 20 || i >= 40;
    capture::FrameSet frame = table.seen_from(truth, i);
    frame.depth = std::make_shared<capture::DepthFrame>(
        test::depth_of_room(room, camera, truth, static_cast<unsigned>(i) + 1, 1));
    const auto result = stage.locate(frame, &field);
    ASSERT_TRUE(result.pose) << i;
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 5) << i;
    if (i >= 20 && i < 40) {
      EXPECT_FALSE(result.warnings.empty()) << i;
    }
  }
}

// Depth of a camera with another pose, or depth that was never registered.
TEST(BadTags, DepthOfAnotherCameraIsNamedAndMovesNoCamera) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::above_the_table(0);
  test::TagTable table;
  table.second = false;
  // At the same distance from the table, turned by 35 degrees; and one that looks at it from elsewhere.
  const Isometry3d turned = truth * Eigen::AngleAxisd(35 * test::kDegree, Eigen::Vector3d::UnitY());
  const Isometry3d elsewhere = test::looking_at_tag(1.6, 10 * test::kDegree, 0.5);
  for (const Isometry3d& other : {turned, elsewhere}) {
    PoseStage stage({"tag36h11", 2, 0.16}, camera);
    for (std::uint64_t i = 0; i < 20; ++i) {
      capture::FrameSet frame = table.seen_from(truth, i);
      frame.depth =
          std::make_shared<capture::DepthFrame>(test::depth_of_table(camera, other, static_cast<unsigned>(i), 1));
      const auto result = stage.locate(frame);
      ASSERT_TRUE(result.pose) << i;
      EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 5) << i;
      EXPECT_EQ(names(result, "is depth that of another camera"), i >= 4) << i;
    }
  }
}

// Many tags of other numbers are no tags of this room.
TEST(BadTags, APosterOfOtherTagsIsIgnored) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::above_the_table(0);
  test::TagTable table;
  table.second = false;
  const capture::FrameSet alone = table.seen_from(truth, 0);
  capture::Tag strangers{"tag36h11", 2, 0.16, {}};
  for (int id = 10; id < 26; ++id) strangers.extra.push_back({id, 0.06, std::nullopt});
  const TagFinder finder(strangers);
  capture::Frame picture = *alone.color;
  for (std::size_t k = 0; k < strangers.extra.size(); ++k) {
    const Isometry3d place = lying_at({0.22 + 0.09 * (k % 4), -0.15 + 0.09 * (k / 4), 0}, 0);
    const capture::Frame print =
        test::view_of_tag(camera, finder.pattern(k + 1), 0.06, place.inverse() * truth, {1, 1});
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector3d d =
            (place.inverse() * truth).linear() * *camera.unproject({static_cast<double>(u), static_cast<double>(v)});
        const Eigen::Vector3d from = (place.inverse() * truth).translation();
        if ((from - from.z() / d.z() * d).cwiseAbs().maxCoeff() < 0.04)
          std::copy_n(&print.encoded.at(u, v), 3, &picture.encoded.at(u, v));
      }
  }
  capture::FrameSet among = alone;
  among.color = std::make_shared<capture::Frame>(picture);
  PoseStage with({"tag36h11", 2, 0.16}, camera), without({"tag36h11", 2, 0.16}, camera), theirs(strangers, camera);
  const auto a = with.locate(among), b = without.locate(alone);
  ASSERT_TRUE(a.pose && b.pose);
  EXPECT_TRUE(a.warnings.empty()) << a.warnings.front();
  EXPECT_LT(test::millimetres_apart(a.pose->T_tag_camera, b.pose->T_tag_camera), 0.5);
  // They are there: a session that has these tags learns them.
  std::size_t seen = 0;
  for (std::uint64_t i = 0; i < 120; i += 8) {
    among.index = i;
    among.time_ns = static_cast<std::int64_t>(i) * kFrameNs;
    theirs.locate(among);
    if (const auto map = theirs.take_tag_map())
      seen = static_cast<std::size_t>(std::ranges::count_if(map->tags, [](const auto& t) { return !!t.T_world_tag; }));
  }
  std::printf("pose: %zu of 16 tags of a poster are seen\n", seen);
  EXPECT_GT(seen, 3u);
}

}  // namespace
}  // namespace lumigraft::reconstruct
