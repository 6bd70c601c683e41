// Rejected calibrations, each with its one reason.
#include "reconstruct/calibrate/acceptance.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

/// Views of the printed board, assigned to the tags of the configured board. Without pictures, corners are not refined.
CameraCalibration calibrated(const capture::CameraModel& camera, const std::vector<Eigen::Isometry3d>& poses,
                             double sigma_px = 0.1, const Board& said = test_board()) {
  std::vector<BoardPicture> pictures;
  for (BoardView& view : exact_views(test_board(), camera, poses, sigma_px, 1)) {
    for (SeenPoints& seen : view.seen) {
      const auto corners_m = said.corners_m(seen.place);
      seen.points_m.assign(corners_m.begin(), corners_m.end());
    }
    pictures.push_back({{}, std::move(view)});
  }
  return calibrate_camera(unknown_camera(camera), BoardFinder(said), pictures);
}

std::string refusal(const std::vector<Eigen::Isometry3d>& poses) {
  return calibrated(distorted_pinhole(), poses).refusal;
}

TEST(CalibrateVerdict, AGoodOneIsNotRefused) {
  EXPECT_EQ(refusal(pinhole_poses(14)), "");
  EXPECT_EQ(calibrated(test_fisheye(), fisheye_poses()).refusal, "");
}

TEST(CalibrateVerdict, TooFewViews) {
  EXPECT_EQ(refusal(pinhole_poses(5)).find("too few views: found 5 pictures"), 0u) << refusal(pinhole_poses(5));
}

TEST(CalibrateVerdict, AllFromOneSide) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 14; ++i) poses.push_back(board_at(0.45, 0.3, M_PI + 0.3 * std::sin(2.0 * i), 0.5, 1.3 * i));
  const std::string said = refusal(poses);
  EXPECT_EQ(said.find("coverage: found corners in"), 0u) << said;
  EXPECT_NE(said.find("right"), std::string::npos) << said;

  poses.clear();
  for (int i = 0; i < 14; ++i) poses.push_back(board_at(0.25, 0.9, 0.5 * std::sin(2.0 * i), 0.3, 1.3 * i));
  const std::string fisheye = calibrated(test_fisheye(), poses).refusal;
  EXPECT_EQ(fisheye.find("coverage: found corners in"), 0u) << fisheye;
  EXPECT_NE(fisheye.find("left"), std::string::npos) << fisheye;
}

TEST(CalibrateVerdict, NeverAtASlant) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 14; ++i) {
    // Boards parallel to the picture: distance and focal length are indistinguishable.
    Eigen::Isometry3d pose = board_at(0.4, 0, 0, 0.005 * i, i);
    pose.translation() += Eigen::Vector3d(0.12 * std::cos(2.4 * i), 0.09 * std::sin(2.4 * i), 0);
    poses.push_back(pose);
  }
  capture::CameraModel plain = distorted_pinhole();
  plain.distortion = {};
  const std::string said = calibrated(plain, poses).refusal;
  EXPECT_EQ(said.find("uncertainty: found the focal length known to"), 0u) << said;
}

TEST(CalibrateVerdict, ABoardThatIsNotAsSaid) {
  Board said = test_board();
  said.spacing_m = 0.016;
  const std::string wide = calibrated(distorted_pinhole(), pinhole_poses(14), 0.1, said).refusal;
  EXPECT_EQ(wide.find("residual: found"), 0u) << wide;
  const std::string noisy = calibrated(distorted_pinhole(), pinhole_poses(14), 0.6).refusal;
  EXPECT_EQ(noisy.find("residual: found corners"), 0u) << noisy;
}

TEST(CalibrateVerdict, ALensThatIsNone) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(20, 460);
  std::vector<BoardPicture> pictures(12);
  for (BoardPicture& picture : pictures) {
    picture.view = exact_view(test_board(), distorted_pinhole(), board_at(0.4, 0, 0), 0, random);
    for (SeenPoints& seen : picture.view.seen)
      for (Eigen::Vector2d& pixel : seen.pixels) pixel = {anywhere(random), anywhere(random)};
  }
  EXPECT_NE(calibrate_camera(unknown_camera(distorted_pinhole()), BoardFinder(test_board()), pictures).refusal, "");
}

}  // namespace
}  // namespace lumigraft::reconstruct
