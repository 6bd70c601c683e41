// Lamps that carry a tag: detected, moved, hidden, with a second tag of the same id, with a wrong size.
#include "reconstruct/pose/lamp_tags.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::int64_t kTagFrameNs = 100'000'000;
constexpr double kLampTag_m = 0.12;
const Vector3d kOnTag(0.02, 0.15, -0.05);

capture::Session session_with_lamp(double size_m = kLampTag_m) {
  capture::Session session;
  session.color.model = test::small_camera();
  session.tag.id = 2;
  session.lamps.push_back({.name = "desk",
                           .tag_id = 9,
                           .tag_size_m = size_m,
                           .position_m = kOnTag,
                           .radius_m = 0.03,
                           .normal = -Vector3d::UnitY(),
                           .intensity = {}});
  return session;
}

/// A tag that leans back on the table.
Isometry3d leaning_at(const Vector3d& place_m) {
  Isometry3d T = Isometry3d::Identity();
  T.translation() = place_m;
  T.linear() = Eigen::AngleAxisd(0.9, Vector3d::UnitX()).toRotationMatrix();
  return T;
}
const Isometry3d kThere = leaning_at({0.1, 0.1, 0.05}), kElsewhere = leaning_at({-0.25, 0.1, 0.05});

Pose camera_pose() {
  Pose pose;
  pose.T_tag_camera = pose.T_tag_camera_raw = test::looking_at_tag(0.9, 0.9, -1.5);
  return pose;
}

/// A frame with tags of the lamp on a grey background.
capture::FrameSet frame_with(const std::vector<Isometry3d>& tags, std::int64_t time_ns, bool depth = false) {
  const capture::CameraModel camera = test::small_camera();
  const TagFinder finder(capture::Tag{"tag36h11", 9, kLampTag_m});
  const Isometry3d T_tag_camera = camera_pose().T_tag_camera;
  capture::Frame picture;
  picture.encoded = capture::Image<std::uint8_t>(camera.width, camera.height, 3, 130);
  capture::DepthFrame far;
  far.depth_m = capture::Image<float>(camera.width, camera.height, 1, 1.5f);
  for (const Isometry3d& tag : tags) {
    const Isometry3d T = tag.inverse() * T_tag_camera;
    const capture::Frame seen = test::view_of_tag(camera, finder.pattern(), kLampTag_m, T, {1, 7});
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
        const Vector3d d = T.linear() * *ray, from = T.translation();
        const double along = -from.z() / d.z();
        if (along < 0 || (from + along * d).cwiseAbs().maxCoeff() > 0.75 * kLampTag_m) continue;
        std::copy_n(&seen.encoded.at(u, v), 3, &picture.encoded.at(u, v));
        far.depth_m.at(u, v) = static_cast<float>(along * ray->z());
      }
  }
  capture::FrameSet frame = test::frame_of(std::move(picture), 0, time_ns);
  if (depth) frame.depth = std::make_shared<capture::DepthFrame>(std::move(far));
  return frame;
}

bool contains(const std::vector<std::string>& warnings, const char* text) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& line) { return line.find(text) != std::string::npos; });
}

double millimetres_off(const LampTagPose& mark, const Isometry3d& tag) {
  return 1e3 * (mark.position_m.cast<double>() - tag * kOnTag).norm();
}

TEST(LampTagStage, ALampMovesWithItsTag) {
  LampTagStage stage(session_with_lamp());
  EXPECT_TRUE(contains(stage.locate(frame_with({}, 0), camera_pose()).warnings, "tag 9 has not been seen yet"));
  for (int i = 1; i < 16; ++i) {
    // At rest, then moved to the left at 30 cm/s.
    const Isometry3d there = leaning_at({0.1 - 0.03 * std::max(0, i - 9), 0.1, 0.05});
    const auto result = stage.locate(frame_with({there}, 5 * kTagFrameNs + i * kTagFrameNs), camera_pose());
    ASSERT_EQ(result.marks.size(), 1u) << i;
    EXPECT_TRUE(result.warnings.empty()) << i << ": " << result.warnings[0];
    const LampTagPose& mark = result.marks[0];
    EXPECT_EQ(mark.lamp, 0);
    EXPECT_LT(millimetres_off(mark, there), 8) << i;
    EXPECT_LT(millimetres_off(mark, there), 3e3 * mark.sigma_m) << i;
    EXPECT_LT(mark.sigma_m, 0.03) << i;
    EXPECT_GT(mark.normal.cast<double>().dot(-there.linear().col(1)), std::cos(0.06)) << i;
  }
}

TEST(LampTagStage, AHiddenLampKeepsItsPositionWithGrowingUncertainty) {
  LampTagStage stage(session_with_lamp());
  const float seen_m = stage.locate(frame_with({kThere}, 0), camera_pose()).marks.at(0).sigma_m;
  const auto early = stage.locate(frame_with({}, 5'000'000'000), camera_pose());
  ASSERT_EQ(early.marks.size(), 1u);
  EXPECT_NEAR(early.marks[0].sigma_m, std::hypot(seen_m, 0.05), 1e-4);
  EXPECT_TRUE(contains(early.warnings, "lamp desk: its tag is hidden"));
  const auto late = stage.locate(frame_with({}, 19'000'000'000), std::nullopt);
  ASSERT_EQ(late.marks.size(), 1u) << "a hidden lamp does not need the camera's pose";
  EXPECT_GT(late.marks[0].sigma_m, 0.15);
  const auto gone = stage.locate(frame_with({}, 21'000'000'000), camera_pose());
  EXPECT_TRUE(gone.marks.empty());
  EXPECT_TRUE(contains(gone.warnings, "hidden for too long"));
  const auto again = stage.locate(frame_with({kElsewhere}, 22'000'000'000), camera_pose());
  ASSERT_EQ(again.marks.size(), 1u);
  EXPECT_LT(millimetres_off(again.marks[0], kElsewhere), 15);
  EXPECT_TRUE(again.warnings.empty());
  EXPECT_TRUE(stage.locate(frame_with({}, 0), camera_pose()).marks.empty()) << "a recording that restarts";
}

TEST(LampTagStage, OfTwoTagsWithOneIdTheExpectedOneIsUsed) {
  LampTagStage stage(session_with_lamp());
  const auto both = stage.locate(frame_with({kElsewhere, kThere}, 0), camera_pose());
  EXPECT_TRUE(both.marks.empty()) << "it is not known which is meant";
  EXPECT_TRUE(contains(both.warnings, "lamp desk: tag 9 is seen 2 times at once, none"));
  stage.locate(frame_with({kThere}, 10'000'000'000), camera_pose());
  const auto known = stage.locate(frame_with({kElsewhere, kThere}, 13'000'000'000), camera_pose());
  ASSERT_EQ(known.marks.size(), 1u);
  EXPECT_LT(millimetres_off(known.marks[0], kThere), 15);
  EXPECT_TRUE(contains(known.warnings, "the one nearest to its last position is used"));
}

TEST(LampTagStage, ATagOfAnotherSizeIsNotUsed) {
  LampTagStage stage(session_with_lamp(0.1)), right(session_with_lamp());
  LampTagStage::Result result, as_said;
  for (int i = 0; i < 8; ++i) {
    const capture::FrameSet frame = frame_with({kThere}, i * kTagFrameNs, true);
    result = stage.locate(frame, camera_pose());
    as_said = right.locate(frame, camera_pose());
  }
  EXPECT_TRUE(result.marks.empty());
  EXPECT_TRUE(contains(result.warnings, "lamp desk: tag 9: by depth its square is 120 mm wide, configured are 100 mm"))
      << result.warnings.at(0);
  EXPECT_EQ(as_said.marks.size(), 1u);
  EXPECT_TRUE(as_said.warnings.empty());
}

}  // namespace
}  // namespace lumigraft::reconstruct
