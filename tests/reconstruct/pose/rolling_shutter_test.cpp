// A tag that is seen by a camera whose rows are exposed one after the other.
#include "reconstruct/pose/rolling_shutter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/pose/pose.h"
#include "reconstruct/pose/tag_search.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using test::kDegree;

constexpr double kUsual_px_s = 100, kTag_row = 250, kRow_s = 4e-5, kFrame_s = 0.04;
constexpr std::int64_t kFrame_ns = 40'000'000;

/// Corners of a tag whose image moves along `path`, and grows by `growth_per_s`.
template <typename Path>
struct MovingTag {
  Path path;
  double growth_per_s = 0;

  TagCorners at(double seconds) const {
    TagCorners corners = {Vector2d(-50, -40), Vector2d(50, -40), Vector2d(50, 40), Vector2d(-50, 40)};
    for (Vector2d& corner : corners) corner = (1 + growth_per_s * seconds) * corner + path(seconds);
    return corners;
  }
  /// Each corner when its own row is exposed; `kTag_row` is exposed at `seconds`.
  TagCorners seen(double seconds) const {
    TagCorners corners = at(seconds);
    for (std::size_t i = 0; i < corners.size(); ++i)
      for (int round = 0; round < 20; ++round) corners[i] = at(seconds + (corners[i].y() - kTag_row) * kRow_s)[i];
    return corners;
  }
};
template <typename Path>
MovingTag(Path) -> MovingTag<Path>;
template <typename Path>
MovingTag(Path, double) -> MovingTag<Path>;

/// Motion in the last of `frames` frames, in which it is `last_s`, if each pose before is right.
template <typename Tag>
ImageMotion followed(const Tag& tag, int frames, double last_s = 0) {
  TagImageMotion image;
  ImageMotion motion;
  const RowTime row_time{kRow_s, 0};
  for (int i = 0; i < frames; ++i) {
    const double now_s = last_s + (i + 1 - frames) * kFrame_s;
    std::optional<TagImageMotion::Expected> expected;
    if (i > 0) expected = {tag.at(now_s - kFrame_s), (i - 1) * kFrame_ns};
    motion = image.update(tag.seen(now_s), expected, kTag_row, i * kFrame_ns, row_time, kUsual_px_s);
  }
  return motion;
}

double largest_gap_px(const TagCorners& a, const TagCorners& b) {
  double gap = 0;
  for (std::size_t i = 0; i < a.size(); ++i) gap = std::max(gap, (a[i] - b[i]).norm());
  return gap;
}

TagCorners at_row_time(const ImageMotion& motion, TagCorners corners) {
  for (Vector2d& corner : corners) corner = motion.at_row_time(corner);
  return corners;
}

TEST(RollingShutter, EvenMotionOfTheImageIsUndone) {
  const MovingTag tag{[](double s) { return Vector2d(320 + 400 * s, kTag_row - 150 * s); }, 0.5};
  EXPECT_GT(largest_gap_px(tag.seen(0), tag.at(0)), 0.6) << "nothing is tested";
  for (const int frames : {2, 3}) {
    const ImageMotion motion = followed(tag, frames);
    EXPECT_LT((motion.velocity_px_s - Vector2d(400, -150)).norm(), frames == 2 ? 1.0 : 0.1) << frames;
    // The growth is known from two poses on. What is left is its change between its frames.
    EXPECT_LT(largest_gap_px(at_row_time(motion, tag.seen(0)), tag.at(0)), frames == 2 ? 0.06 : 0.003) << frames;
  }
}

TEST(RollingShutter, EvenAccelerationIsFollowed) {
  const MovingTag tag{[](double s) { return Vector2d(320 + 200 * s + 1000 * s * s, kTag_row); }};
  const ImageMotion motion = followed(tag, 3);
  EXPECT_LT((motion.velocity_px_s - Vector2d(200, 0)).norm(), 0.5);
  EXPECT_NEAR(motion.velocity_sigma_px_s, 2000 * kFrame_s / 2, 0.5) << "by as much as acceleration adds";
}

TEST(RollingShutter, TheVelocityOfAShakenHandIsWithinItsSigma) {
  const double reach_px = 20;
  for (const double turns_s : {0.5, 1.0, 2.0, 3.0, 5.0}) {
    const auto angle = [&](double s) { return 2 * M_PI * turns_s * s; };
    const MovingTag tag{[&](double s) { return Vector2d(320 + reach_px * std::sin(angle(s)), kTag_row); }};
    double worst_sigmas = 0, squares = 0, mean_squares = 0;
    constexpr int kTimes = 100;
    for (int i = 0; i < kTimes; ++i) {
      const double now_s = i / (turns_s * kTimes);
      const ImageMotion motion = followed(tag, 4, now_s);
      const double truth = 2 * M_PI * turns_s * reach_px * std::cos(angle(now_s));
      const double off = motion.velocity_px_s.x() - truth;
      const double mean = reach_px * (std::sin(angle(now_s)) - std::sin(angle(now_s - kFrame_s))) / kFrame_s;
      worst_sigmas = std::max(worst_sigmas, std::abs(off) / motion.velocity_sigma_px_s);
      squares += off * off;
      mean_squares += (mean - truth) * (mean - truth);
    }
    std::printf(
        "rolling shutter: a hand that shakes at %.1f Hz: velocity off by at most %.2f sigma, %.2f of the mean's\n",
        turns_s, worst_sigmas, std::sqrt(squares / mean_squares));
    EXPECT_LT(worst_sigmas, 2) << turns_s;
    EXPECT_LT(squares, mean_squares) << turns_s << ": the mean velocity since the last frame is nearer";
  }
}

TEST(RollingShutter, WhatIsNotKnownIsSaid) {
  const MovingTag tag{[](double s) { return Vector2d(320 + 400 * s, kTag_row); }};
  EXPECT_EQ(followed(tag, 1).velocity_sigma_px_s, kUsual_px_s) << "no pose before";
  EXPECT_EQ(followed(tag, 1).velocity_px_s, Vector2d::Zero());
  EXPECT_NEAR(followed(tag, 2).velocity_sigma_px_s, 400, 1) << "it may have begun to move";
  EXPECT_GT(RowTime::of(std::nullopt, 480).sigma_s, 0);
  EXPECT_EQ(RowTime::of(std::nullopt, 480).seconds, 0);
  EXPECT_DOUBLE_EQ(RowTime::of(0.0479, 480).seconds, 1e-4);
  EXPECT_EQ(RowTime::of(0.0, 480).sigma_s, 0);
}

struct Seen {
  double off_mm, claimed_mm;
};
Seen seen_by(const test::RollingShutter& shutter, const std::optional<double>& readout_s, double tilt_deg,
             bool reported = false) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::looking_at_tag(0.6, tilt_deg * kDegree, -1.2);
  struct Reporting {
    PoseStage stage;
    std::optional<double> readout_s;
    PoseStage::Result locate(capture::FrameSet frame) {
      capture::Frame says = *frame.color;
      says.readout_s = readout_s;
      frame.color = std::make_shared<capture::Frame>(std::move(says));
      return stage.locate(frame);
    }
  } stage{PoseStage(test::some_tag(), camera, capture::Response::srgb(), {}, reported ? std::nullopt : readout_s),
          reported ? readout_s : std::nullopt};
  const auto pose = shutter.locate(stage, camera, truth).pose;
  EXPECT_TRUE(pose);
  return pose ? Seen{1e3 * (pose->T_tag_camera_raw.translation() - truth.translation()).norm(),
                     1e3 * position_sigma_m(pose->covariance)}
              : Seen{};
}

TEST(RollingShutter, PosesOfAMovingCameraAreRightWhereTheReadoutIsKnown) {
  test::RollingShutter pan{0.02}, walk{0.02}, roll{0.02}, up{-0.02};
  pan.turn_rad_s = {0, 40 * kDegree, 0};
  walk.speed_m_s = {0.3, 0, 0.1};
  roll.turn_rad_s = {0, 0, 60 * kDegree};
  up.turn_rad_s = {0, 40 * kDegree, 0};
  for (const double tilt_deg : {10.0, 45.0})
    for (const test::RollingShutter& shutter : {pan, walk, roll, up}) {
      const Seen stated = seen_by(shutter, shutter.readout_s, tilt_deg), unknown = seen_by(shutter, {}, tilt_deg);
      std::printf("rolling shutter: tilt of %.0f degrees: stated %.2f mm (claimed %.2f), unknown %.2f mm (%.2f)\n",
                  tilt_deg, stated.off_mm, stated.claimed_mm, unknown.off_mm, unknown.claimed_mm);
      EXPECT_LT(stated.off_mm, 1.5);
      EXPECT_LT(stated.off_mm, 3 * stated.claimed_mm);
      EXPECT_LT(unknown.off_mm, 3 * unknown.claimed_mm);
    }
}

TEST(RollingShutter, AReportedReadoutTimeIsUsed) {
  test::RollingShutter pan{0.02};
  pan.turn_rad_s = {0, 40 * kDegree, 0};
  EXPECT_EQ(seen_by(pan, 0.02, 45, true).off_mm, seen_by(pan, 0.02, 45).off_mm);
}

TEST(RollingShutter, ACameraAtRestIsAsSureAsWithAGlobalShutter) {
  const test::RollingShutter rest{0.02};
  const Seen global = seen_by(rest, 0.0, 45);
  for (const auto& readout_s : {std::optional(0.02), std::optional<double>()}) {
    const Seen rolling = seen_by(rest, readout_s, 45);
    EXPECT_NEAR(rolling.off_mm, global.off_mm, 0.1 * global.claimed_mm);
    EXPECT_NEAR(rolling.claimed_mm, global.claimed_mm, 0.1 * global.claimed_mm);
  }
}

TEST(RollingShutter, ATagThatIsPushedSaysNothingOfTheCamera) {
  const auto moving = [](double speed_px_s, double sigma_px_s, double row_sigma_s) {
    ImageMotion motion;
    motion.row_time = {row_sigma_s > 0 ? 0 : kRow_s, row_sigma_s};
    motion.velocity_px_s = {speed_px_s, 0};
    motion.velocity_sigma_px_s = sigma_px_s;
    return motion;
  };
  for (const double row_sigma_s : {kRow_s, 0.0}) {
    std::vector<ImageMotion> motions = {moving(10, 3, row_sigma_s), moving(900, 500, row_sigma_s),
                                        moving(0, 0, row_sigma_s)};
    limit_to_common_motion(motions, {true, true, false});
    EXPECT_EQ(motions[0].velocity_px_s.x(), 10);
    EXPECT_EQ(motions[1].velocity_sigma_px_s, 3);
    // Where the readout is known the tag's points are moved by how its image moves.
    EXPECT_NEAR(motions[1].velocity_px_s.x(), row_sigma_s > 0 ? 10 : 900, 1e-9);
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
