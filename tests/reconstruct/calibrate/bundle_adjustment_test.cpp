// Bundle adjustment on exact corners of a camera model with known errors added.
#include "reconstruct/calibrate/bundle_adjustment.h"

#include <gtest/gtest.h>

#include "reconstruct/calibrate/initial_guess.h"
#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

std::vector<Eigen::Isometry3d> poses_of(const capture::CameraModel& camera) {
  return camera.kind == capture::CameraModel::Kind::pinhole ? pinhole_poses(12) : fisheye_poses();
}

TEST(CalibrateStart, FindsTheBoardsPoseAndTheFocalLength) {
  for (const capture::CameraModel& camera : {distorted_pinhole(), test_fisheye()}) {
    const auto poses = poses_of(camera);
    const auto views = exact_views(test_board(), camera, poses, 0, 1);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto pose = board_pose(views[i], camera);
      ASSERT_TRUE(pose);
      EXPECT_TRUE(pose->isApprox(poses[i], 1e-6)) << i;
    }
    const auto start = start_camera(unknown_camera(camera), views);
    ASSERT_TRUE(start);
    EXPECT_NEAR(start->cameras[0].fx, camera.fx, 0.25 * camera.fx) << "distortion is not looked for yet";
  }
}

TEST(CalibrateAdjust, ExactCornersGiveTheExactLens) {
  for (const capture::CameraModel& camera : {distorted_pinhole(), test_fisheye()}) {
    const auto poses = poses_of(camera);
    const auto views = exact_views(test_board(), camera, poses, 0, 1);
    const auto start = start_camera(unknown_camera(camera), views);
    ASSERT_TRUE(start);
    const auto found = adjust(*start, {views}, Freedom::all);
    ASSERT_TRUE(found);
    EXPECT_LT(farthest_apart_px(found->rig.cameras[0], camera, 85 * kTestDegree), 1e-3);
    for (std::size_t i = 0; i < poses.size(); ++i)
      EXPECT_LT((found->rig.T_first_board[i].matrix() - poses[i].matrix()).norm(), 1e-4);
  }
}

TEST(CalibrateAdjust, LeavesOutWhatNoLensExplains) {
  const capture::CameraModel camera = distorted_pinhole();
  const auto poses = poses_of(camera);
  auto views = exact_views(test_board(), camera, poses, 0.05, 1);
  views[3].seen[2].pixels[1] += Eigen::Vector2d(3, -2);  // outliers: a finger covers a corner
  for (auto& pixel : views[7].seen[1].pixels) pixel.x() += 12;
  const auto start = start_camera(unknown_camera(camera), views);
  ASSERT_TRUE(start);
  const auto found = adjust(*start, {views}, Freedom::all);
  ASSERT_TRUE(found);
  int outliers = 0;
  for (const Residual& residual : found->residuals) {
    outliers += residual.outlier;
    EXPECT_TRUE(!residual.outlier || residual.moment == 3 || residual.moment == 7);
  }
  EXPECT_EQ(outliers, 8) << "the corners of two tags";
  views[3].seen.erase(views[3].seen.begin() + 2);
  views[7].seen.erase(views[7].seen.begin() + 1);
  const auto without = adjust(*start, {views}, Freedom::all);
  ASSERT_TRUE(without);
  EXPECT_LT(farthest_apart_px(found->rig.cameras[0], without->rig.cameras[0], 0), 1e-3);
}

/// Fraction of parameters within one sigma of the truth over many noise realisations: 68 %. All parameters of a run
/// depend on the same noise; the runs are independent.
TEST(CalibrateAdjust, SigmasAreHonest) {
  constexpr int kRuns = 30;
  for (const capture::CameraModel& camera : {distorted_pinhole(), test_fisheye()}) {
    const int numbers = camera.kind == capture::CameraModel::Kind::pinhole ? 9 : 8;
    const LensNumbers truth = lens_numbers(camera);
    const auto poses = poses_of(camera);
    int within = 0, within_two = 0;
    for (unsigned run = 1; run <= kRuns; ++run) {
      const auto views = exact_views(test_board(), camera, poses, 0.15, run);
      const Rig start{{camera}, {Eigen::Isometry3d::Identity()}, poses};
      const auto found = adjust(start, {views}, Freedom::all);
      ASSERT_TRUE(found);
      const LensNumbers is = lens_numbers(found->rig.cameras[0]);
      for (int i = 0; i < numbers; ++i) {
        const double sigmas = std::abs(is[static_cast<std::size_t>(i)] - truth[static_cast<std::size_t>(i)]) /
                              std::sqrt(found->covariance(i, i));
        within += sigmas < 1;
        within_two += sigmas < 2;
      }
    }
    const double within_one_sigma = within / (1.0 * numbers * kRuns),
                 within_two_sigma = within_two / (1.0 * numbers * kRuns);
    std::printf("%d numbers in %d runs: %.0f %% within one sigma, %.0f %% within two\n", numbers, kRuns,
                100 * within_one_sigma, 100 * within_two_sigma);
    EXPECT_GT(within_one_sigma, 0.58);
    EXPECT_LT(within_one_sigma, 0.78);
    EXPECT_GT(within_two_sigma, 0.90);
  }
}

TEST(CalibrateAdjust, TwoCamerasAndTheirRelativePose) {
  const capture::CameraModel color = distorted_pinhole(), fisheye = test_fisheye();
  const Eigen::Isometry3d T_fisheye_color =
      Eigen::Translation3d(0.05, -0.03, 0.02) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, 1, -0.2).normalized());
  constexpr int kRuns = 20;
  int within = 0;
  for (unsigned run = 1; run <= kRuns; ++run) {
    std::vector<Eigen::Isometry3d> poses = pinhole_poses(16), seen_by_fisheye;
    for (const auto& pose : poses) seen_by_fisheye.push_back(T_fisheye_color * pose);
    const RigViews views = {exact_views(test_board(), color, poses, 0.05, run),
                            exact_views(test_board(), fisheye, seen_by_fisheye, 0.05, run + 1000)};
    const Rig start{{color, fisheye}, {Eigen::Isometry3d::Identity(), T_fisheye_color}, poses};
    const auto found = adjust(start, views, Freedom::all);
    ASSERT_TRUE(found);
    const Eigen::Isometry3d is = found->rig.T_camera_first[1];
    EXPECT_LT((is.translation() - T_fisheye_color.translation()).norm(), 1e-3);
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(is.linear() * T_fisheye_color.linear().transpose()));
    EXPECT_LT(turn.angle(), 0.1 * kTestDegree);
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), is.translation() - T_fisheye_color.translation();
    const Eigen::VectorXd sigma = found->covariance.diagonal().tail<6>().cwiseSqrt();
    for (int i = 0; i < 6; ++i) within += std::abs(error[i]) < sigma[i];
  }
  const double within_one_sigma = within / (6.0 * kRuns);
  std::printf("stand: %.0f %% within one sigma\n", 100 * within_one_sigma);
  EXPECT_GT(within_one_sigma, 0.53);
  EXPECT_LT(within_one_sigma, 0.83);
}

}  // namespace
}  // namespace lumigraft::reconstruct
