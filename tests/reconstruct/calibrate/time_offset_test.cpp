// The time offset of a second camera's clock from corners of a moving board.
#include "reconstruct/calibrate/time_offset.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

Eigen::Isometry3d rig_T_fisheye_color() {
  return Eigen::Translation3d(0.05, -0.03, 0.02) * Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.3, 1, -0.2).normalized());
}

/// A hand-held board that oscillates at about 1 Hz; a `reach` of 1 is 6 cm and 15°.
Eigen::Isometry3d held_board(double time_s, double reach) {
  const double a = 2 * M_PI * 0.9 * time_s, b = 2 * M_PI * 0.6 * time_s;
  return board_at(0.42 + 0.03 * reach * std::sin(b), reach * 0.14 * std::sin(a), 0.5 + 0.2 * std::sin(b),
                  0.3 + 0.25 * reach * std::cos(b), 0.8, 0.2 * reach * std::sin(a + b));
}

struct Seen {
  std::vector<TimedView> color, fisheye;
};

/// Colour pictures every 100 ms, fish-eye pictures 40 ms after them; the fish-eye's clock is `behind_s` behind.
Seen seen(double behind_s, double reach, double seconds, double sigma_px, unsigned seed) {
  std::mt19937 random(seed);
  Seen all;
  const auto add = [&](std::vector<TimedView>& views, const capture::CameraModel& camera,
                       const Eigen::Isometry3d& T_camera_color, double true_s, double stamp_s) {
    views.push_back({1'000'000'000'000 + std::llround(1e9 * stamp_s),
                     exact_view(test_board(), camera, T_camera_color * held_board(true_s, reach), sigma_px, random)});
  };
  for (double t = 0; t < seconds; t += 0.1) {
    add(all.color, distorted_pinhole(), Eigen::Isometry3d::Identity(), t, t);
    add(all.fisheye, test_fisheye(), rig_T_fisheye_color(), t + 0.04, t + 0.04 - behind_s);
  }
  return all;
}

TimeOffsetCalibration found(const Seen& seen) {
  // A relative pose with small errors, as from static boards.
  const Eigen::Isometry3d about = Eigen::Translation3d(0.0004, -0.0003, 0.0005) * rig_T_fisheye_color();
  return calibrate_time(distorted_pinhole(), test_fisheye(), about, seen.color, seen.fisheye);
}

TEST(CalibrateTime, TheOffsetIsFoundToHalfAMillisecond) {
  for (const double behind_s : {0.0123, -0.031, 0.184}) {
    const TimeOffsetCalibration time = found(seen(behind_s, 1, 5, 0.05, 1));
    EXPECT_EQ(time.refusal, "");
    EXPECT_NEAR(time.offset_s, behind_s, 0.0005);
    EXPECT_NEAR(time.offset_s, behind_s, 4 * time.sigma_s);
    EXPECT_LT(time.median_px, 0.3);
    std::printf("behind by %.1f ms: found %.2f ± %.2f ms, board at %.0f px/s, %.2f px\n", 1e3 * behind_s,
                1e3 * time.offset_s, 1e3 * time.sigma_s, time.speed_px, time.median_px);
  }
}

TEST(CalibrateTime, SigmasAreHonest) {
  constexpr int kRuns = 12;
  int within = 0, within_two = 0;
  for (unsigned run = 1; run <= kRuns; ++run) {
    const TimeOffsetCalibration time = found(seen(0.02, 1, 3, 0.3, run));
    within += std::abs(time.offset_s - 0.02) < time.sigma_s;
    within_two += std::abs(time.offset_s - 0.02) < 2 * time.sigma_s;
  }
  std::printf("%d of %d within one sigma, %d within two\n", within, kRuns, within_two);
  EXPECT_GE(within, 0.5 * kRuns);
  EXPECT_GE(within_two, 0.85 * kRuns);
}

TEST(CalibrateTime, RefusesAStillBoardAndOneThatIsNotSeen) {
  const std::string still = found(seen(0.02, 0.001, 3, 0.05, 1)).refusal;
  EXPECT_EQ(still.find("uncertainty: found the offset known to"), 0u) << still;
  EXPECT_EQ(found({}).refusal.find("too few pictures: found 0 of the fish-eye"), 0u);
  Seen late = seen(0.02, 1, 2, 0.05, 1);
  for (TimedView& view : late.fisheye) view.time_ns += 60'000'000'000;
  EXPECT_EQ(found(late).refusal.find("too few pictures"), 0u);
}

}  // namespace
}  // namespace lumigraft::reconstruct
