// Several tags in one room: bundles, two tags of one id, wrong sizes, covered tags.
#include "reconstruct/pose/multi_tag_pose.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/pose_views.h"
#include "tests/reconstruct/pose/tag_table.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;
using test::kSecondTag;
using test::lying_at;
using Table = test::TagTable;

std::vector<std::string> all_warnings(const PoseStage::Result& result, const char* with) {
  std::vector<std::string> found;
  for (const std::string& text : result.warnings)
    if (text.find(with) != std::string::npos) found.push_back(text);
  return found;
}

TEST(PoseTags, OneOfABundleIsEnough) {
  PoseStage stage({"tag36h11", 2, 0.16, {{5, 0.16, kSecondTag}}}, test::small_camera());
  for (unsigned i = 0; i < 12; ++i) {
    Table table;
    table.first = i < 3 || i >= 9;
    table.second = i < 6 || i >= 9;
    const auto result = stage.locate(table.seen_from(test::above_the_table(i), i));
    ASSERT_TRUE(result.pose) << i;
    if (i >= 6 && i < 9) continue;  // neither
    EXPECT_EQ(result.pose->age_ns, 0) << i;
    EXPECT_TRUE(result.warnings.empty()) << i << ": " << result.warnings[0];
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, test::above_the_table(i)), 4) << i;
    EXPECT_LT(test::degrees_apart(result.pose->T_tag_camera_raw, test::above_the_table(i)), 0.25) << i;
  }
}

TEST(PoseTags, TwoAreMoreCertainThanOne) {
  double one_mm = 0, two_mm = 0, one_sigma = 0, two_sigma = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const capture::FrameSet frame = Table().seen_from(test::above_the_table(3 * i), 0, 5);
    PoseStage one({"tag36h11", 2, 0.16}, test::small_camera());
    PoseStage two({"tag36h11", 2, 0.16, {{5, 0.16, kSecondTag}}}, test::small_camera());
    const auto a = one.locate(frame), b = two.locate(frame);
    ASSERT_TRUE(a.pose && b.pose);
    one_mm += test::millimetres_apart(a.pose->T_tag_camera, test::above_the_table(3 * i)) / 8;
    two_mm += test::millimetres_apart(b.pose->T_tag_camera, test::above_the_table(3 * i)) / 8;
    one_sigma += 1e3 * position_sigma_m(a.pose->covariance) / 8;
    two_sigma += 1e3 * position_sigma_m(b.pose->covariance) / 8;
  }
  std::printf("pose: one tag %.2f mm (sigma %.2f), two %.2f mm (sigma %.2f)\n", one_mm, one_sigma, two_mm, two_sigma);
  EXPECT_LT(two_sigma, one_sigma);
  EXPECT_LT(two_mm, 1.3 * one_mm);
}

TEST(PoseTags, AnUnknownPoseIsLearntWhileBothAreSeen) {
  PoseStage stage({"tag36h11", 2, 0.16, {{5, 0.16, std::nullopt}}}, test::small_camera());
  Table table;
  const auto first = stage.locate(table.seen_from(test::above_the_table(0), 0));
  ASSERT_TRUE(first.pose);
  EXPECT_EQ(all_warnings(first, "tag 5: not used until").size(), 1u);
  std::uint64_t i = 1;
  PoseStage::Result result = first;
  // Until its pose is known the whole image is searched four times a second.
  for (; i < 120 && !all_warnings(result, "tag 5").empty(); i += 8)
    result = stage.locate(table.seen_from(test::above_the_table(static_cast<unsigned>(i)), i));
  EXPECT_LT(i, 110u);
  table.first = false;
  const auto alone = stage.locate(table.seen_from(test::above_the_table(static_cast<unsigned>(i)), i));
  ASSERT_TRUE(alone.pose);
  EXPECT_EQ(alone.pose->age_ns, 0);
  EXPECT_LT(test::millimetres_apart(alone.pose->T_tag_camera_raw, test::above_the_table(static_cast<unsigned>(i))), 4);
}

TEST(PoseTags, AMisplacedTagIsReported) {
  PoseStage stage({"tag36h11", 2, 0.16, {{5, 0.16, lying_at({0.33, 0.05, 0}, 0.4)}}}, test::small_camera());
  std::size_t left_out = 0, misplaced = 0;
  for (unsigned i = 0; i < 12; ++i) {
    const auto result = stage.locate(Table().seen_from(test::above_the_table(i), i));
    ASSERT_TRUE(result.pose);
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, test::above_the_table(i)), 4) << i;
    left_out += all_warnings(result, "tag 5: contradicts the others").size();
    misplaced += all_warnings(result, "tag 5: is 50 mm").size();
  }
  EXPECT_GE(left_out, 7u);
  EXPECT_GE(misplaced, 4u);
}

TEST(PoseTags, TwoTagsOfOneIdAreReportedAndTheNearerIsTracked) {
  PoseStage stage({"tag36h11", 2, 0.16}, test::small_camera());
  Table table;
  table.second_id = 2;
  table.second = false;
  for (unsigned i = 0; i < 40; ++i) {
    if (i % 4 != 0 && i != 1) continue;
    table.second = i > 2;  // someone lays a second one down
    const auto result = stage.locate(table.seen_from(test::above_the_table(i), i));
    ASSERT_TRUE(result.pose);
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, test::above_the_table(i)), 4) << i;
    EXPECT_EQ(all_warnings(result, "tag 2: seen 2 times at once").size(), i >= 32 ? 1u : 0u) << i;
  }
}

TEST(PoseTags, AnotherSizeIsDetectedByDepth) {
  const auto warnings = [](double printed_m, float depth_scale) {
    PoseStage stage({"tag36h11", 2, 0.16}, test::small_camera());
    Table table;
    table.second = false;
    table.size_m = printed_m;
    PoseStage::Result result;
    for (unsigned i = 0; i < 6; ++i) {
      capture::FrameSet frame = table.seen_from(test::above_the_table(i), i);
      capture::DepthFrame depth = test::depth_of_table(test::small_camera(), test::above_the_table(i), i, 1);
      for (float& z : depth.depth_m.data) z *= depth_scale;
      frame.depth = std::make_shared<capture::DepthFrame>(std::move(depth));
      result = stage.locate(frame);
      EXPECT_TRUE(i >= 4 || result.warnings.empty());
    }
    return result.warnings;
  };
  EXPECT_TRUE(warnings(0.16, 1).empty());
  EXPECT_TRUE(warnings(0.16, 1.02f).empty()) << "within the error of depth cameras";
  const auto small = warnings(0.148, 1), large = warnings(0.175, 1), unit = warnings(0.16, 1000);
  ASSERT_EQ(small.size(), 1u);
  EXPECT_EQ(small[0].substr(0, 39), "tag 2: by depth its square is 148 mm wi") << small[0];
  ASSERT_EQ(large.size(), 1u);
  EXPECT_EQ(large[0].substr(0, 36), "tag 2: by depth its square is 175 mm") << large[0];
  ASSERT_EQ(unit.size(), 1u);
  EXPECT_NE(unit[0].find("in another unit"), std::string::npos) << unit[0];
}

// Depth contradicts the size of a second tag with the same id, which is not used. The camera jumps to and fro, so that
// both tags are detected in each frame.
TEST(PoseTags, TheSizeCheckUsesTheTagInUse) {
  const capture::CameraModel camera = test::small_camera();
  for (const double side : {-1, 1}) {
    PoseStage stage({"tag36h11", 2, 0.16}, camera);
    Table table;
    table.second_id = 2;
    table.T_tag_second = lying_at({0.24 * side, 0, 0}, 0);
    for (unsigned i = 0; i < 16; ++i) {
      table.second = i > 0;
      const Isometry3d T = test::looking_at_tag(0.9, 40 * kDegree, -M_PI / 2, {0.12 * side, i % 2 ? -0.14 : 0.16, 0});
      capture::FrameSet frame = table.seen_from(T, i);
      capture::DepthFrame depth = test::depth_of_table(camera, T, i, 1);
      for (int v = 0; v < camera.height; ++v)
        for (int u = 0; u < camera.width; ++u)
          if (table.is_of_second(camera, T, u, v)) depth.depth_m.at(u, v) *= 1.2f;
      frame.depth = std::make_shared<capture::DepthFrame>(std::move(depth));
      const auto result = stage.locate(frame);
      ASSERT_TRUE(result.pose);
      EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, T), 5) << i;
      EXPECT_EQ(all_warnings(result, "by depth").size(), 0u) << testing::PrintToString(result.warnings);
    }
  }
}

// A hand covers the tag's corner: no square is detected, but most of the print is visible.
TEST(PoseTags, APartlyCoveredTagGivesAPose) {
  PoseStage stage({"tag36h11", 2, 0.16}, test::small_camera());
  const Isometry3d truth = test::looking_at_tag(0.8, 45 * kDegree, -1.4);
  Table table;
  table.second = false;
  int followed = 0;
  for (unsigned i = 0; i < 8; ++i) {
    capture::FrameSet frame = table.seen_from(truth, i);
    if (i >= 3) {
      capture::Frame covered = *frame.color;
      const capture::CameraModel camera = test::small_camera();
      for (int v = 0; v < camera.height; ++v)
        for (int u = 0; u < camera.width; ++u) {
          const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
          const Vector3d d = truth.linear() * *ray;
          const Vector3d p = truth.translation() - truth.translation().z() / d.z() * d;
          if (p.x() + p.y() > 0.085) std::fill_n(&covered.encoded.at(u, v), 3, 150);
        }
      frame.color = std::make_shared<capture::Frame>(std::move(covered));
    }
    const auto result = stage.locate(frame);
    ASSERT_TRUE(result.pose);
    if (i < 3) continue;
    followed += result.pose->age_ns == 0;
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, truth), 5) << i;
  }
  EXPECT_EQ(followed, 5);
}

}  // namespace
}  // namespace lumigraft::reconstruct
