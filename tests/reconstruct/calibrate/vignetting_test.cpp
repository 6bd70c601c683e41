// Vignetting of a lens from white paper in uneven illumination.
#include "reconstruct/calibrate/vignetting.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

constexpr capture::Vignetting kLens{{-0.24, 0.02, -0.022}};  // transmission 0.28 at 85°

/// Illumination of the board: uniform, or by a ceiling lamp and by the room's walls, which reflect a third of its
/// light.
double irradiance(const Eigen::Isometry3d& T_camera_board, const Eigen::Vector2d& on_board, bool even) {
  if (even) return 1;
  const Eigen::Vector3d lamp(0.4, -1.5, 0.6), place = T_camera_board * Eigen::Vector3d(on_board.x(), on_board.y(), 0);
  const Eigen::Vector3d to_lamp = lamp - place;
  const double cosine = std::max(0.0, T_camera_board.linear().col(2).dot(to_lamp.normalized()));
  return 0.3 + 2 * cosine / to_lamp.squaredNorm();
}

std::vector<WhiteSample> samples(bool even, unsigned seed, const std::vector<Eigen::Isometry3d>& poses) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.005);
  std::uniform_real_distribution<double> light(0.3, 1.0);  // a hand's shadow, or another exposure
  std::vector<BoardView> views = exact_views(test_board(), test_fisheye(), poses, 0.02, seed);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double level = light(random);
    for (SeenPoints& seen : views[i].seen) seen.paper = level;
  }
  std::vector<WhiteSample> all = white_of(views, test_fisheye());
  for (WhiteSample& one : all)
    one.light *=
        irradiance(poses[one.moment], one.on_board_m, even) * kLens.transmission(one.angle_rad) * (1 + noise(random));
  return all;
}

double worst_relative(const capture::Vignetting& found) {
  double worst = 0;
  for (int degrees = 0; degrees <= 85; ++degrees)
    worst = std::max(
        worst, std::abs(found.transmission(degrees * kTestDegree) / kLens.transmission(degrees * kTestDegree) - 1));
  return worst;
}

TEST(CalibrateVignetting, IsFoundInEvenLightToAPercentAndUnderALampToThree) {
  for (const bool even : {true, false}) {
    const auto found = calibrate_vignetting(samples(even, 1, fisheye_poses()), 95 * kTestDegree);
    EXPECT_EQ(found.refusal, "");
    EXPECT_GT(found.widest_rad, 80 * kTestDegree);
    std::printf("%s: off by %.2f %% at worst, %.2f %% (1 sigma) said; uneven by %.1f %%, readings to %.2f %%\n",
                even ? "even" : "lamp", 100 * worst_relative(found.vignetting), 100 * found.widest_sigma,
                100 * found.unevenness, 100 * found.residual);
    EXPECT_LT(worst_relative(found.vignetting), even ? 0.01 : 0.03);
  }
}

TEST(CalibrateVignetting, SigmasAreHonest) {
  constexpr int kRuns = 40;
  for (const bool even : {true, false}) {
    int within = 0, within_two = 0;
    for (unsigned run = 1; run <= kRuns; ++run) {
      auto poses = fisheye_poses();
      for (std::size_t i = 0; i < poses.size(); ++i)  // another rotation of the board
        poses[i] = Eigen::AngleAxisd(0.7 * run, Eigen::Vector3d::UnitZ()) * poses[i];
      const auto found = calibrate_vignetting(samples(even, run, poses), 95 * kTestDegree);
      const double angle = 95 * kTestDegree;
      const double off = std::abs(std::log(found.vignetting.transmission(angle) / kLens.transmission(angle)));
      within += off < found.widest_sigma;
      within_two += off < 2 * found.widest_sigma;
    }
    std::printf("%s: %d of %d within one sigma, %d within two\n", even ? "even" : "lamp", within, kRuns, within_two);
    EXPECT_GE(within, 0.5 * kRuns);
    EXPECT_GE(within_two, 0.88 * kRuns);
  }
}

TEST(CalibrateVignetting, AFingersShadowIsLeftOut) {
  auto all = samples(true, 1, fisheye_poses());
  for (std::size_t i = 0; i < all.size(); i += 29) all[i].light *= 0.6;
  EXPECT_LT(worst_relative(calibrate_vignetting(all, 95 * kTestDegree).vignetting), 0.015);
}

TEST(CalibrateVignetting, RefusesWhatSaysTooLittle) {
  EXPECT_EQ(calibrate_vignetting({}, 1.6).refusal.find("too few views: found 0 pictures with white paper"), 0u);
  std::vector<Eigen::Isometry3d> middle;
  for (int i = 0; i < 12; ++i) middle.push_back(board_at(0.3, 0.1, i, 0.2, i));
  const std::string said = calibrate_vignetting(samples(false, 1, middle), 95 * kTestDegree).refusal;
  EXPECT_EQ(said.find("uncertainty: found the lens's falloff known to"), 0u) << said;
}

}  // namespace
}  // namespace lumigraft::reconstruct
