// Tracking by depth while the tag is hidden: a camera moves past furniture, and the tag is covered for some time.
#include "reconstruct/pose/depth_tracking.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/pose_room.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;
using test::kFrameNs;
using test::some_tag;

/// A hand-held camera: 0.25 m/s, 12° a second.
Isometry3d camera_on_path(std::uint64_t index) {
  const double t = 1e-9 * static_cast<double>(kFrameNs) * static_cast<double>(index);
  return test::looking_at_tag(1.2 + 0.05 * std::sin(2 * t), (48 + 4 * std::sin(1.5 * t)) * kDegree, -1.4 + 0.2 * t,
                              {0.0, 0.15, 0.1});
}

class DepthTrackingFrames : public testing::Test {
 protected:
  capture::FrameSet frame(std::uint64_t index, bool hidden, double depth_noise) const {
    capture::Frame picture;
    if (hidden)
      picture.encoded = capture::Image<std::uint8_t>(320, 240, 3, 120);
    else
      picture = test::view_of_tag(camera, finder.pattern(), 0.16, camera_on_path(index),
                                  {2, static_cast<unsigned>(index) + 1});
    capture::FrameSet frame = test::frame_of(std::move(picture), index, static_cast<std::int64_t>(index) * kFrameNs);
    frame.depth = std::make_shared<capture::DepthFrame>(
        test::depth_of_room(room, camera, camera_on_path(index), static_cast<unsigned>(index) + 1, depth_noise));
    return frame;
  }

  const capture::CameraModel camera = test::small_camera();
  const TagFinder finder{some_tag()};
  const TestRoom room = test::furnished_room();
  const DistanceField field = room.field();
};

TEST_F(DepthTrackingFrames, TracksByDepthAndReturnsToTheTag) {
  constexpr std::uint64_t kHides = 4, kBack = 28, kEnd = 40;
  std::vector<capture::FrameSet> frames;
  for (std::uint64_t i = 0; i < kEnd; ++i) frames.push_back(frame(i, i >= kHides && i < kBack, 1));
  // Noisy depth, and depth with a scale error of a percent: then depth and print differ by a centimetre.
  for (const float depth_scale : {1.0f, 1.01f}) {
    PoseStage stage(some_tag(), camera);
    double carried_mm = 0, carried_degrees = 0, step_mm = 0, other_step_mm = 0, sigmas = 0;
    Isometry3d last_error = Isometry3d::Identity();
    for (std::uint64_t i = 0; i < kEnd; ++i) {
      const bool hidden = i >= kHides && i < kBack;
      capture::FrameSet seen = frames[i];
      capture::DepthFrame depth = *seen.depth;
      for (float& z : depth.depth_m.data) z *= depth_scale;
      seen.depth = std::make_shared<capture::DepthFrame>(std::move(depth));
      const auto result = stage.locate(seen, &field);
      ASSERT_TRUE(result.pose) << i;
      const Pose& pose = *result.pose;
      const Isometry3d truth = camera_on_path(i);
      EXPECT_EQ(pose.from, hidden ? Pose::From::surface : Pose::From::tag) << i;
      EXPECT_EQ(pose.time_ns, static_cast<std::int64_t>(i) * kFrameNs);
      EXPECT_EQ(pose.age_ns, hidden ? static_cast<std::int64_t>(i - kHides + 1) * kFrameNs : 0);
      // The text must not change, or a log would repeat it for every frame.
      std::vector<std::string> wanted;
      if (hidden) wanted = {"tag: not in the picture, the pose is tracked by depth"};
      EXPECT_EQ(result.warnings, wanted) << i;
      // Only the change of the error from frame to frame is visible.
      const Isometry3d error = truth.inverse() * pose.T_tag_camera;
      const double step = i > 0 ? test::millimetres_apart(error, last_error) : 0;
      last_error = error;
      const bool handed_over = (i >= kHides && i < kHides + 2) || (i >= kBack && i < kBack + 8);
      (handed_over ? step_mm : other_step_mm) = std::max(handed_over ? step_mm : other_step_mm, step);
      if (!hidden) continue;
      carried_mm = std::max(carried_mm, test::millimetres_apart(pose.T_tag_camera, truth));
      carried_degrees = std::max(carried_degrees, test::degrees_apart(pose.T_tag_camera, truth));
      sigmas = std::max(
          sigmas, (pose.T_tag_camera.translation() - truth.translation()).norm() / position_sigma_m(pose.covariance));
    }
    std::printf(
        "pose: hidden for %.1f s, depth scale %.2f: at most %.2f mm, %.3f deg off, %.1f sigma; error changes by at "
        "most "
        "%.2f mm a frame where handed over, %.2f mm elsewhere\n",
        1e-9 * static_cast<double>(kFrameNs) * (kBack - kHides), static_cast<double>(depth_scale), carried_mm,
        carried_degrees, sigmas, step_mm, other_step_mm);
    EXPECT_LT(carried_mm, 3);
    EXPECT_LT(carried_degrees, 0.15);
    EXPECT_LT(step_mm, 2);
    EXPECT_LT(step_mm, 1.5 * other_step_mm) << "compared with the tag's noise";
  }
}

// The camera rests, and a person walks between it and the tag: much of the picture moves as a whole, also against the
// field, in which they are where they were in the last frame.
TEST_F(DepthTrackingFrames, APersonWhoWalksByMovesNoCamera) {
  constexpr std::int64_t kIntervalNs = 200'000'000;
  constexpr float kStep_m = 0.15f, kInReach_m = 1.1f;
  const Isometry3d rests = camera_on_path(0);
  const auto with_person = [&](float x_m) {
    TestRoom now = room;
    now.boxes.push_back({{x_m - 0.15f, -0.3f, -0.1f}, {x_m + 0.15f, -0.2f, 1.2f}});
    return now;
  };
  PoseStage stage(some_tag(), camera);
  double off_mm = 0;
  int tracked = 0;
  for (int i = 0; i < 16; ++i) {
    const float x_m = -1.9f + static_cast<float>(i) * kStep_m, before_m = x_m - kStep_m;
    capture::Frame picture;
    if (std::abs(x_m) < 0.3f)
      picture.encoded = capture::Image<std::uint8_t>(320, 240, 3, 120);
    else
      picture = test::view_of_tag(camera, finder.pattern(), 0.16, rests, {2, static_cast<unsigned>(i) + 1});
    capture::FrameSet seen = test::frame_of(std::move(picture), static_cast<std::uint64_t>(i), i * kIntervalNs);
    seen.depth = std::make_shared<capture::DepthFrame>(
        test::depth_of_room(with_person(x_m), camera, rests, static_cast<unsigned>(i) + 1, 1));
    const DistanceField fused = std::abs(before_m) < kInReach_m ? with_person(before_m).field() : field;
    const auto result = stage.locate(seen, &fused);
    ASSERT_TRUE(result.pose) << i;
    if (result.pose->from != Pose::From::surface) continue;
    ++tracked;
    off_mm = std::max(off_mm, test::millimetres_apart(result.pose->T_tag_camera, rests));
  }
  EXPECT_GT(tracked, 2);
  EXPECT_LT(off_mm, 10);
}

// One who walks slowly is within reach of what fusion has of them: only the room of a second ago does not follow.
TEST_F(DepthTrackingFrames, APersonWhoWalksSlowlyMovesNoCamera) {
  constexpr std::int64_t kIntervalNs = 100'000'000;
  constexpr float kStep_m = 0.025f;
  constexpr int kComes = 12;
  const Isometry3d rests = camera_on_path(0);
  const auto with_person = [&](int i) {
    TestRoom now = room;
    const float x_m = -0.3f + kStep_m * static_cast<float>(i - kComes);
    if (i >= kComes) now.boxes.push_back({{x_m - 0.15f, -0.3f, -0.1f}, {x_m + 0.15f, -0.2f, 1.2f}});
    return now;
  };
  PoseStage stage(some_tag(), camera);
  double off_mm = 0;
  for (int i = 0; i < 24; ++i) {
    const auto index = static_cast<unsigned>(i);
    capture::Frame picture;
    if (i >= kComes)
      picture.encoded = capture::Image<std::uint8_t>(320, 240, 3, 120);
    else
      picture = test::view_of_tag(camera, finder.pattern(), 0.16, rests, {2, index + 1});
    capture::FrameSet seen = test::frame_of(std::move(picture), index, i * kIntervalNs);
    seen.depth =
        std::make_shared<capture::DepthFrame>(test::depth_of_room(with_person(i), camera, rests, index + 1, 1));
    const DistanceField fused = with_person(i - 1).field();
    const auto result = stage.locate(seen, &fused);
    ASSERT_TRUE(result.pose) << i;
    if (result.pose->from == Pose::From::surface)
      off_mm = std::max(off_mm, test::millimetres_apart(result.pose->T_tag_camera, rests));
  }
  EXPECT_LT(off_mm, 10);
}

// The camera rests; the tag is pushed by 4 cm along the floor and stays there.
TEST_F(DepthTrackingFrames, ATagThatIsPushedMovesNoObject) {
  constexpr std::uint64_t kPushed = 5, kKnown = kPushed + 3;
  const Isometry3d truth = camera_on_path(0);
  PoseStage stage(some_tag(), camera);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Isometry3d T_tag_room(Eigen::Translation3d(i < kPushed ? 0 : -0.04, 0, 0));
    capture::FrameSet seen = test::frame_of(
        test::view_of_tag(camera, finder.pattern(), 0.16, T_tag_room * truth, {2, static_cast<unsigned>(i) + 1}), i,
        static_cast<std::int64_t>(i) * kFrameNs);
    seen.depth = frame(0, true, 1).depth;
    const auto result = stage.locate(seen, &field);
    ASSERT_TRUE(result.pose) << i;
    EXPECT_EQ(result.pose->from, i >= kPushed && i < kKnown ? Pose::From::surface : Pose::From::tag) << i;
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 5) << i;
    ASSERT_EQ(result.warnings.empty(), i < kPushed) << i;
    if (i < kKnown) continue;
    EXPECT_NE(result.warnings.front().find("tag 2: it was moved by "), std::string::npos) << result.warnings.front();
  }
}

// The same where the exhibit follows the tag: the room stays, the exhibit's frame is that of the tag.
TEST_F(DepthTrackingFrames, ATagThatIsPushedTakesTheExhibitWithIt) {
  constexpr std::uint64_t kPushed = 5, kKnown = kPushed + 3;
  const Isometry3d truth = camera_on_path(0), T_tag_pushed(Eigen::Translation3d(0.04, 0, 0));
  for (const bool follows : {false, true}) {
    capture::Tag tag = some_tag();
    tag.moves_exhibit = follows;
    PoseStage stage(tag, camera);
    for (std::uint64_t i = 0; i < 12; ++i) {
      const Isometry3d T_pushed_camera = i < kPushed ? truth : T_tag_pushed.inverse() * truth;
      capture::FrameSet seen = test::frame_of(
          test::view_of_tag(camera, finder.pattern(), 0.16, T_pushed_camera, {2, static_cast<unsigned>(i) + 1}), i,
          static_cast<std::int64_t>(i) * kFrameNs);
      seen.depth = frame(0, true, 1).depth;
      const auto result = stage.locate(seen, &field);
      ASSERT_TRUE(result.pose) << i;
      EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 5) << i << ": the room stays";
      if (i >= kPushed && i < kKnown - 1) continue;
      const Isometry3d expected = follows && i >= kKnown ? T_tag_pushed : Isometry3d::Identity();
      if (i != kKnown - 1) {
        EXPECT_LT(test::millimetres_apart(result.pose->T_tag_exhibit, expected), 5) << i;
        EXPECT_EQ(result.pose->T_tag_exhibit.isApprox(Isometry3d::Identity(), 1e-12), !follows || i < kPushed) << i;
      }
      if (i < kKnown) continue;
      EXPECT_NE(result.warnings.front().find(follows ? "objects moved with it" : "objects stay where they were"),
                std::string::npos)
          << result.warnings.front();
    }
  }
}

// Someone carries the tag away slowly: less from frame to frame than noise, while the camera and the room rest.
TEST_F(DepthTrackingFrames, ATagThatIsCarriedSlowlyMovesNoCamera) {
  const Isometry3d truth = camera_on_path(0);
  for (const double step_m : {0.002, 0.004}) {
    PoseStage stage(some_tag(), camera);
    double max_mm = 0, silent_mm = 0;
    for (std::uint64_t i = 0; i < 60; ++i) {
      const double carried_m = i < 10 ? 0 : step_m * static_cast<double>(i - 9);
      const Isometry3d T_tag_room(Eigen::Translation3d(-0.6 * carried_m, -0.8 * carried_m, 0));
      capture::FrameSet seen = test::frame_of(
          test::view_of_tag(camera, finder.pattern(), 0.16, T_tag_room * truth, {2, static_cast<unsigned>(i) + 1}), i,
          static_cast<std::int64_t>(i) * kFrameNs);
      seen.depth = std::make_shared<capture::DepthFrame>(
          test::depth_of_room(room, camera, truth, static_cast<unsigned>(i) + 1, 1));
      const auto result = stage.locate(seen, &field);
      ASSERT_TRUE(result.pose) << i;
      const double off_mm = test::millimetres_apart(result.pose->T_tag_camera, truth);
      max_mm = std::max(max_mm, off_mm);
      if (result.warnings.empty()) silent_mm = std::max(silent_mm, off_mm);
    }
    std::printf("pose: tag carried at %.0f mm a frame over %.0f mm: the camera at most %.1f mm off, in silence %.1f\n",
                1e3 * step_m, 5e4 * step_m, max_mm, silent_mm);
    EXPECT_LT(max_mm, 20);
  }
}

// Over a bare floor depth cannot distinguish a camera that starts to move from a tag that is pushed: the tag is used.
TEST_F(DepthTrackingFrames, OverABareFloorTheCameraMovesAndNotTheTag) {
  TestRoom bare;
  bare.half_m = 0.9f;
  const DistanceField floor = bare.field();
  PoseStage stage(some_tag(), camera);
  for (std::uint64_t i = 0; i < 12; ++i) {
    const double moved_m = i < 5 ? 0 : 0.05 * static_cast<double>(i - 4);  // 1.5 m/s from one frame to the next
    const Isometry3d truth = Eigen::Translation3d(0.6 * moved_m, 0.8 * moved_m, 0) * camera_on_path(0);
    capture::FrameSet seen =
        test::frame_of(test::view_of_tag(camera, finder.pattern(), 0.16, truth, {2, static_cast<unsigned>(i) + 1}), i,
                       static_cast<std::int64_t>(i) * kFrameNs);
    seen.depth = std::make_shared<capture::DepthFrame>(
        test::depth_of_room(bare, camera, truth, static_cast<unsigned>(i) + 1, 1));
    const auto result = stage.locate(seen, &floor);
    ASSERT_TRUE(result.pose) << i;
    EXPECT_EQ(result.pose->from, Pose::From::tag) << i;
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 5) << i;
    EXPECT_TRUE(result.warnings.empty()) << i << " " << result.warnings.front();
  }
}

TEST_F(DepthTrackingFrames, WithoutFieldOrDepthThePoseOnlyAges) {
  for (const bool with_field : {false, true}) {
    PoseStage stage(some_tag(), camera);
    const DistanceField* const given = with_field ? &field : nullptr;
    ASSERT_TRUE(stage.locate(frame(0, false, 0), given).pose);
    capture::FrameSet blind = frame(1, true, 0);
    if (with_field) blind.depth = nullptr;
    const auto result = stage.locate(blind, given);
    ASSERT_TRUE(result.pose);
    EXPECT_EQ(result.pose->from, Pose::From::past);
    EXPECT_EQ(result.pose->time_ns, 0);
    EXPECT_EQ(result.pose->age_ns, kFrameNs);
    EXPECT_GT(position_sigma_m(result.pose->covariance), 0.005);
  }
}

// A bare floor does not determine translations along it: tracking stops before the pose is unknown.
TEST_F(DepthTrackingFrames, StopsOnABareFloor) {
  TestRoom bare = room;
  bare.boxes.clear();
  const DistanceField floor = bare.field();
  const Isometry3d above = test::looking_at_tag(0.9, 10 * kDegree, -1.2);
  PoseStage stage(some_tag(), camera);
  int carried = 0;
  double max_mm = 0;
  for (std::uint64_t i = 0; i < 60; ++i) {
    capture::Frame picture;
    if (i > 0)
      picture.encoded = capture::Image<std::uint8_t>(320, 240, 3, 120);
    else
      picture = test::view_of_tag(camera, finder.pattern(), 0.16, above);
    capture::FrameSet seen = test::frame_of(std::move(picture), i, static_cast<std::int64_t>(i) * kFrameNs);
    seen.depth =
        std::make_shared<capture::DepthFrame>(test::depth_of_room(bare, camera, above, static_cast<unsigned>(i), 1));
    const auto result = stage.locate(seen, &floor);
    if (!result.pose) break;
    if (result.pose->from != Pose::From::surface) continue;
    ++carried;
    max_mm = std::max(max_mm, 1e3 * position_sigma_m(result.pose->covariance));
  }
  EXPECT_GT(carried, 2);
  EXPECT_LT(carried, 40);
  EXPECT_LT(max_mm, 30);
}

TEST(DepthTracking, UncertaintyGrowsWithTime) {
  const PoseCovariance none = PoseCovariance::Zero();
  EXPECT_LT(position_sigma_m(DepthTracking::predicted(none, 1.0 / 30)), 0.02);
  EXPECT_GT(position_sigma_m(DepthTracking::predicted(none, 0.3)), 0.1);
}

}  // namespace
}  // namespace lumigraft::reconstruct
