#include "relight/compose/change_fade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/compose/parameters.h"

namespace lumigraft::test {
namespace {

using Picture = capture::Image<std::uint8_t>;

/// A room of dark and bright things.
Picture room(float light = 1) {
  Picture picture(128, 96, 3);
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < picture.width; ++u) {
      const float value = 0.05f + 0.6f * static_cast<float>((u / 24 + v / 24) % 3) / 2;
      for (int c = 0; c < 3; ++c) picture.at(u, v, c) = capture::srgb_table().code(light * value);
    }
  }
  return picture;
}

/// Of a camera whose pose is known until it is lost.
struct Film {
  relight::ChangeFade fade;
  std::int64_t time_ns = 1'000'000'000, seen_ns = 0;

  float frame(std::int64_t after_ns, bool seen, const Picture& picture) {
    capture::FrameSet frame;
    frame.time_ns = time_ns += after_ns;
    reconstruct::Pose pose;
    if (seen) seen_ns = time_ns;
    pose.time_ns = seen_ns;
    pose.from = seen ? reconstruct::Pose::From::surface : reconstruct::Pose::From::past;
    fade.follow(frame, picture, pose);
    return fade.opacity();
  }
};

constexpr std::int64_t kFrame = 33'333'333;

TEST(ChangeFade, NothingFadesWhileNothingIsMissing) {
  Film film;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(film.frame(kFrame, true, room()), 1);
  const auto camera = std::make_shared<const Picture>(room());
  Picture relit(128, 96, 3, 77);
  film.fade.apply(camera, &relit);
  EXPECT_EQ(relit.data, Picture(128, 96, 3, 77).data);
}

TEST(ChangeFade, OneFrameWithoutAPoseIsNoReason) {
  Film film;
  for (int i = 0; i < 30; ++i) EXPECT_EQ(film.frame(kFrame, i % 3 != 2, room()), 1);
}

// At any rate of frames, and never by a large step.
TEST(ChangeFade, WithoutAPoseAllFadesOutInAFractionOfASecondAndInAgain) {
  for (const int rate : {15, 30, 60}) {
    SCOPED_TRACE(rate);
    Film film;
    const std::int64_t gap = 1'000'000'000 / rate;
    for (int i = 0; i < 10; ++i) film.frame(gap, true, room());
    const std::int64_t lost_ns = film.time_ns;
    float last = 1;
    while (last > 0) {
      const float now = film.frame(gap, false, room());
      EXPECT_LE(now, last);
      EXPECT_LE(last - now, static_cast<float>(gap) / relight::kCompose.fade_out_ns + 1e-4f);
      last = now;
    }
    const auto took_ns = static_cast<double>(film.time_ns - lost_ns);
    const double all_ns = relight::kCompose.unseen_ns + relight::kCompose.fade_out_ns;
    EXPECT_GE(took_ns, all_ns - gap);
    EXPECT_LE(took_ns, all_ns + 2.0 * gap);
    EXPECT_LT(took_ns, static_cast<double>(reconstruct::PoseStage::kAgeLimitNs)) << "the pose goes earlier";
    const std::int64_t back_ns = film.time_ns;
    while (last < 1) {
      const float now = film.frame(gap, true, room());
      EXPECT_GT(now, last);
      EXPECT_LE(now - last, static_cast<float>(gap) / relight::kCompose.fade_in_ns + 1e-4f);
      last = now;
    }
    EXPECT_GE(film.time_ns - back_ns, relight::kCompose.fade_in_ns - gap);
  }
}

TEST(ChangeFade, HalfFadedIsHalfTheChange) {
  Film film;
  film.frame(kFrame, true, room());
  while (film.frame(kFrame, false, room()) > 0.6f) {
  }
  const float opacity = film.fade.opacity();
  ASSERT_GT(opacity, 0.2f);
  const auto camera = std::make_shared<const Picture>(Picture(128, 96, 3, 100));
  Picture relit(128, 96, 3, 200);
  relit.at(0, 0, 0) = 100;
  film.fade.apply(camera, &relit);
  EXPECT_NEAR(relit.at(5, 5, 1), 100 + 100 * opacity, 1);
  EXPECT_EQ(relit.at(0, 0, 0), 100);
}

// Over black an object is never brighter than the room was dimmed.
TEST(ChangeFade, UnderACoveredLensObjectsDarkenWithThePictureAndFadeOut) {
  Film film;
  for (int i = 0; i < 30; ++i) film.frame(kFrame, true, room());
  const auto camera = std::make_shared<const Picture>(room());
  Picture relit = room();
  for (int v = 20; v < 40; ++v) {
    for (int u = 20; u < 40; ++u) relit.at(u, v, 0) = relit.at(u, v, 1) = relit.at(u, v, 2) = 250;
  }
  film.fade.apply(camera, &relit);
  const Picture black(128, 96, 3, 6);
  EXPECT_LT(film.frame(kFrame, true, black), 0.05f);
  EXPECT_TRUE(film.fade.covered());
  Picture shown = black;
  film.fade.add_last(&shown);
  EXPECT_LT(*std::max_element(shown.data.begin(), shown.data.end()), 40);
  for (int i = 0; i < 10; ++i) film.frame(kFrame, true, black);
  EXPECT_EQ(film.fade.opacity(), 0);
  // And back.
  float last = 0;
  for (int i = 0; i < 6; ++i) {
    const float now = film.frame(kFrame, true, room());
    EXPECT_FALSE(film.fade.covered());
    EXPECT_GT(now, last);
    EXPECT_LT(now - last, 0.1f);
    last = now;
  }
}

TEST(ChangeFade, AWhiteCoverLetsThemFadeOutToo) {
  Film film;
  for (int i = 0; i < 30; ++i) film.frame(kFrame, true, room());
  const Picture white(128, 96, 3, 230);
  const float first = film.frame(kFrame, true, white);
  EXPECT_TRUE(film.fade.covered());
  EXPECT_GT(first, 0.7f);
  for (int i = 0; i < 10; ++i) film.frame(kFrame, true, white);
  EXPECT_EQ(film.fade.opacity(), 0);
}

TEST(ChangeFade, ALampThatIsSwitchedOffIsNoCover) {
  Film film;
  for (int i = 0; i < 30; ++i) film.frame(kFrame, true, room());
  for (int i = 0; i < 300; ++i) EXPECT_EQ(film.frame(kFrame, true, room(0.1f)), 1) << i;
}

}  // namespace
}  // namespace lumigraft::test
