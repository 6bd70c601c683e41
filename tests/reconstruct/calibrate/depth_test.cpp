// Pose of a depth camera, from depth of boards whose pose the colour camera measures.
#include "reconstruct/calibrate/depth.h"

#include <gtest/gtest.h>

#include <functional>

#include "reconstruct/calibrate/depth_noise.h"
#include "tests/reconstruct/calibrate/board_views.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

capture::CameraModel depth_camera() {
  capture::CameraModel camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 288;
  camera.cx = 161;
  camera.cy = 118;
  return camera;
}

Eigen::Isometry3d true_T_color_depth() {
  return Eigen::Translation3d(0.025, -0.002, 0.004) *
         Eigen::AngleAxisd(0.03, Eigen::Vector3d(0.4, 1, -0.6).normalized());
}

/// 1σ of depth by depth and angle of incidence.
using NoiseModel = std::function<double(double depth_m, double incidence_rad)>;

double triangulation_noise(double depth_m, double) { return 0.0015 * depth_m * depth_m; }

/// Depth of the board in front of a wall, with noise and a resolution of 1 mm.
capture::Image<float> depth_of(const Board& board, const Eigen::Isometry3d& T_color_board, const NoiseModel& noise,
                               std::mt19937& random) {
  const capture::CameraModel camera = depth_camera();
  const Eigen::Isometry3d T_board_depth = T_color_board.inverse() * true_T_color_depth();
  const Eigen::Vector2d half = 0.5 * board.extent_m() + Eigen::Vector2d::Constant(0.5 * board.size_m);
  std::normal_distribution<double> gauss(0, 1);
  capture::Image<float> depth_m(camera.width, camera.height, 1);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const Eigen::Vector3d d = T_board_depth.linear() * ray, from = T_board_depth.translation();
      double z = -from.z() / d.z();
      const Eigen::Vector3d at = from + z * d;
      if (!(z > 0) || std::abs(at.x()) > half.x() || std::abs(at.y()) > half.y()) z = 1.5;
      z += noise(z, std::acos(std::abs(d.normalized().z()))) * gauss(random);
      depth_m.at(u, v) = static_cast<float>(random() % 50 == 0 ? 0 : 0.001 * std::lround(1000 * z));
    }
  return depth_m;
}

struct DepthScene {
  std::vector<capture::Image<float>> pictures;
  std::vector<BoardDepthView> views;
};

/// Boards all over the picture, slanted, or all parallel to it.
DepthScene depth_scene(int count, unsigned seed, bool slanted = true, const NoiseModel& noise = triangulation_noise) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  DepthScene all;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i)
    poses.push_back(slanted ? board_at(0.45 + 0.02 * (i % 12), 0.15 + 0.1 * (i % 3), 2.4 * i + 0.3 * seed,
                                       0.25 + 0.03 * (i % 14), 1.3 * i, 0.4 * i)
                            : board_at(0.5, 0, 0, 0, 0, 0.4 * i));
  for (const Eigen::Isometry3d& pose : poses) all.pictures.push_back(depth_of(test_board(), pose, noise, random));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    // The colour camera's error of the board's pose.
    const Eigen::Vector3d w = 3e-4 * Eigen::Vector3d(gauss(random), gauss(random), gauss(random));
    const Eigen::Vector3d t = 3e-4 * Eigen::Vector3d(gauss(random), gauss(random), gauss(random));
    const Eigen::Isometry3d off = Eigen::Translation3d(t) * Eigen::AngleAxisd(w.norm(), w.normalized());
    Eigen::Isometry3d seen = poses[i];
    seen.linear() = off.linear() * seen.linear();
    seen.translation() += t;
    all.views.push_back({&all.pictures[i], seen});
  }
  return all;
}

TEST(CalibrateDepth, PoseToAMillimetreAndATenthOfADegree) {
  const DepthScene seen = depth_scene(24, 1);
  // Initial error 3 cm and 2°.
  const DepthCalibration found =
      calibrate_depth(depth_camera(), Eigen::Isometry3d::Identity(), test_board(), seen.views);
  EXPECT_EQ(found.refusal, "");
  EXPECT_EQ(found.views, 24);
  const double mm = millimetres_apart(found.T_color_depth, true_T_color_depth());
  const double degrees = degrees_apart(found.T_color_depth, true_T_color_depth());
  std::printf("%.2f mm ± %.2f, %.3f° ± %.3f; depth %.2f mm from the boards in the median\n", mm,
              1e3 * found.shift_sigma_m.norm(), degrees, found.turn_sigma_rad.norm() / kTestDegree,
              1e3 * found.median_m);
  EXPECT_LT(mm, 1.0);
  EXPECT_LT(degrees, 0.1);
}

TEST(CalibrateDepth, NoiseIsMeasured) {
  for (const auto principle : {capture::DepthPrinciple::structured_light, capture::DepthPrinciple::time_of_flight,
                               capture::DepthPrinciple::stereo}) {
    const capture::DepthNoise truth = capture::usual_noise(principle, 1.7);
    const DepthScene seen =
        depth_scene(16, 3, true, [&](double z, double incidence_rad) { return truth.sigma_m(z, incidence_rad); });
    const DepthNoiseCalibration found =
        measure_depth_noise(depth_camera(), principle, true_T_color_depth(), test_board(), seen.views);
    EXPECT_EQ(found.views, 16);
    EXPECT_NEAR(found.scale, 1.7, 0.1) << capture::name_of(principle);
    EXPECT_LT(found.nearest_m, 0.6);
    EXPECT_GT(found.far_m, found.nearest_m + 0.1);
  }
  const DepthScene few = depth_scene(5, 1);
  EXPECT_EQ(measure_depth_noise(depth_camera(), capture::DepthPrinciple::stereo, true_T_color_depth(), test_board(),
                                few.views)
                .views,
            0);
}

TEST(CalibrateDepth, SigmasAreHonest) {
  constexpr int kRuns = 12;
  int within = 0, within_two = 0;
  for (unsigned run = 1; run <= kRuns; ++run) {
    const DepthScene seen = depth_scene(14, run);
    const DepthCalibration found = calibrate_depth(depth_camera(), true_T_color_depth(), test_board(), seen.views);
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(found.T_color_depth.linear() * true_T_color_depth().linear().transpose()));
    Eigen::Matrix<double, 6, 1> error, sigma;
    error << turn.angle() * turn.axis(), found.T_color_depth.translation() - true_T_color_depth().translation();
    sigma << found.turn_sigma_rad, found.shift_sigma_m;
    for (int i = 0; i < 6; ++i) {
      within += std::abs(error[i]) < sigma[i];
      within_two += std::abs(error[i]) < 2 * sigma[i];
    }
  }
  std::printf("%.0f %% within one sigma, %.0f %% within two\n", within / (0.06 * kRuns), within_two / (0.06 * kRuns));
  EXPECT_GT(within, 0.52 * 6 * kRuns);
  EXPECT_GT(within_two, 0.85 * 6 * kRuns);
}

TEST(CalibrateDepth, RefusesWhatSaysTooLittleOrIsNotSo) {
  const auto refusal = [](const DepthScene& seen) {
    return calibrate_depth(depth_camera(), Eigen::Isometry3d::Identity(), test_board(), seen.views).refusal;
  };
  EXPECT_EQ(refusal(depth_scene(5, 1)).find("too few views: found 5 pictures whose depth shows the board"), 0u);
  EXPECT_EQ(refusal(depth_scene(12, 1, false)).find("uncertainty: found the depth camera's pose known"), 0u)
      << refusal(depth_scene(12, 1, false));
  DepthScene long_counts = depth_scene(12, 1);
  for (capture::Image<float>& picture : long_counts.pictures)
    for (float& z : picture.data) z *= 1.1f;
  EXPECT_NE(refusal(long_counts), "");
}

}  // namespace
}  // namespace lumigraft::reconstruct
