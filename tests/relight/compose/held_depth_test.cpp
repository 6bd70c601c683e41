// Frames without depth.
#include "relight/compose/held_depth.h"

#include <gtest/gtest.h>

#include <cmath>

#include "relight/compose/change_fade.h"
#include "relight/compose/parameters.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test::held_depth_tests {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr double kFocal_px = 60;
constexpr float kWall_m = 2, kHand_m = 0.5f;
constexpr std::int64_t kFrame_ns = 33'333'333;

/// A camera before a wall, with a square hand in the middle of the picture.
class Film {
 public:
  relight::HeldDepth held{session_of(kWidth, kHeight, kFocal_px).color.model};

  capture::FrameSet frame(bool with_depth, double right_m = 0) {
    capture::FrameSet frame;
    frame.time_ns = time_ns_ += kFrame_ns;
    if (with_depth) {
      auto depth = std::make_shared<capture::DepthFrame>();
      depth->depth_m = capture::Image<float>(kWidth, kHeight, 1, kWall_m);
      for (int v = 20; v < 28; ++v) {
        for (int u = 28; u < 36; ++u) depth->depth_m.at(u, v) = kHand_m;
      }
      frame.depth = depth;
    }
    reconstruct::Pose pose;
    pose.T_tag_camera.translation().x() = right_m;
    pose.time_ns = time_ns_;
    return held.complete(frame, pose);
  }

 private:
  std::int64_t time_ns_ = 1'000'000'000;
};

TEST(HeldDepth, IsThatOfTheLastFrameUntilDepthHasStopped) {
  Film film;
  std::shared_ptr<const capture::DepthFrame> last;
  for (int i = 0; i < 5; ++i) last = film.frame(true).depth;
  std::int64_t missing_ns = 0;
  const std::int64_t usual_ns = std::max(relight::kCompose.unseen_ns, 2 * kFrame_ns);
  for (int i = 0; i < 20; ++i) {
    missing_ns += kFrame_ns;
    const capture::FrameSet frame = film.frame(false);
    const bool given_up = missing_ns > usual_ns + relight::kCompose.fade_out_ns;
    EXPECT_EQ(frame.depth, given_up ? nullptr : last) << i;
    EXPECT_EQ(film.held.stopped(), !given_up && missing_ns > usual_ns) << i;
  }
  EXPECT_TRUE(film.frame(true).depth);
  EXPECT_FALSE(film.held.stopped());
}

TEST(HeldDepth, OfASlowerDepthCameraNeverStops) {
  for (const int every : {2, 3, 6, 12}) {
    Film film;
    film.frame(true);
    for (int i = 1; i <= every; ++i) film.frame(i == every);
    for (int i = 1; i < 100; ++i) {
      EXPECT_TRUE(film.frame(i % every == 0).depth) << i;
      EXPECT_FALSE(film.held.stopped()) << i;
    }
  }
}

TEST(HeldDepth, WithoutADepthCameraThereIsNone) {
  Film film;
  for (int i = 0; i < 30; ++i) {
    EXPECT_FALSE(film.frame(false).depth);
    EXPECT_FALSE(film.held.stopped());
  }
}

/// A camera that moves to the right by x sees what is at z to the left by f x / z.
TEST(HeldDepth, IsSeenFromWhereTheCameraIs) {
  Film film;
  film.frame(true);
  const double right_m = 4 * kHand_m / kFocal_px;  // the hand moves by 4 pixels, the wall by one
  const capture::FrameSet frame = film.frame(false, right_m);
  ASSERT_TRUE(frame.depth);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const float z_m = frame.depth->depth_m.at(u, v);
      const bool on_hand = v >= 20 && v < 28 && u >= 24 && u < 32;
      // What the hand hid is not known, nor is what comes into the picture.
      const bool unknown = (v >= 20 && v < 28 && u >= 32 && u < 35) || u == kWidth - 1;
      EXPECT_NEAR(z_m, on_hand ? kHand_m : unknown ? 0 : kWall_m, 1e-5f) << u << ", " << v;
    }
  }
}

/// No step of the opacity is larger than one of its fades; while depth is exchanged nothing is to be seen.
TEST(HeldDepth, WhenItStopsAllFadesOutWithItAndInWithoutIt) {
  Film film;
  relight::ChangeFade fade;
  const capture::Image<std::uint8_t> picture(kWidth, kHeight, 3, 100);
  bool had = true;
  float last = 1, least = 1;
  for (int i = 0; i < 60; ++i) {
    const capture::FrameSet frame = film.frame(i < 10);
    reconstruct::Pose pose;
    pose.time_ns = frame.time_ns;
    pose.from = reconstruct::Pose::From::tag;
    fade.follow(frame, picture, pose, film.held.stopped());
    const float now = fade.opacity();
    EXPECT_LE(last - now, static_cast<float>(kFrame_ns) / relight::kCompose.fade_out_ns + 1e-4f) << i;
    EXPECT_LE(now - last, static_cast<float>(kFrame_ns) / relight::kCompose.fade_in_ns + 1e-4f) << i;
    if (had && !frame.depth) {
      EXPECT_LT(now, 0.2f) << "when it is given up";
    }
    had = frame.depth != nullptr;
    last = now;
    least = std::min(least, now);
  }
  EXPECT_LT(least, 0.2f);
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace lumigraft::test::held_depth_tests
