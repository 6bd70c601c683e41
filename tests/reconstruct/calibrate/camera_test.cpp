// Lenses estimated from rendered boards, compared with the true lens.
#include "reconstruct/calibrate/camera.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

std::vector<BoardPicture> drawn(const capture::CameraModel& camera, const BoardFinder& finder,
                                const std::vector<Eigen::Isometry3d>& poses) {
  const BoardDrawing drawing(test_board(), camera);
  std::vector<BoardPicture> pictures;
  for (const Eigen::Isometry3d& pose : poses) {
    BoardSensor sensor;
    sensor.seed = static_cast<unsigned>(pictures.size() + 1);
    pictures.push_back(board_picture(finder, drawing.picture(pose, sensor)));
  }
  return pictures;
}

TEST(CalibrateCamera, FindsAPinholeWithDistortion) {
  const BoardFinder finder(test_board());
  const capture::CameraModel truth = distorted_pinhole();
  auto pictures = drawn(truth, finder, pinhole_poses(12));
  const CameraCalibration found = calibrate_camera(unknown_camera(truth), finder, pictures);
  EXPECT_EQ(found.refusal, "");
  EXPECT_EQ(found.views, 12);
  EXPECT_NEAR(found.model.fx, truth.fx, 0.002 * truth.fx);
  EXPECT_NEAR(found.model.fy, truth.fy, 0.002 * truth.fy);
  EXPECT_NEAR(found.model.cx, truth.cx, 0.5);
  EXPECT_NEAR(found.model.cy, truth.cy, 0.5);
  EXPECT_LT(found.median_px, 0.05);
  EXPECT_LT(found.percent95_px, 0.15);
  EXPECT_LT(farthest_apart_px(found.model, truth, 0), 0.3);
  const LensNumbers is = lens_numbers(found.model), was = lens_numbers(truth);
  for (std::size_t i = 0; i < kLensNumbers; ++i) EXPECT_NEAR(is[i], was[i], 4 * found.sigma[i]) << i;
}

TEST(CalibrateCamera, FindsAFisheye) {
  const BoardFinder finder(test_board());
  const capture::CameraModel truth = test_fisheye();
  auto pictures = drawn(truth, finder, fisheye_poses());
  const CameraCalibration found = calibrate_camera(unknown_camera(truth), finder, pictures);
  EXPECT_EQ(found.refusal, "");
  EXPECT_NEAR(found.model.fx, truth.fx, 0.002 * truth.fx);
  EXPECT_NEAR(found.model.cx, truth.cx, 0.5);
  EXPECT_NEAR(found.model.cy, truth.cy, 0.5);
  EXPECT_GT(found.coverage.widest_rad, 85 * kTestDegree);
  EXPECT_LT(farthest_apart_px(found.model, truth, 85 * kTestDegree), 0.3);
  EXPECT_EQ(found.model.fov_rad, truth.fov_rad);
  const LensNumbers is = lens_numbers(found.model), was = lens_numbers(truth);
  for (std::size_t i = 0; i < kLensNumbers; ++i) EXPECT_NEAR(is[i], was[i], 4 * found.sigma[i]) << i;
}

}  // namespace
}  // namespace lumigraft::reconstruct
