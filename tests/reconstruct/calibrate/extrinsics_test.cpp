// Relative pose of two cameras from rendered boards, and their pose relative to a tag in the room.
#include "reconstruct/calibrate/extrinsics.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/calibrate/board_views.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

Eigen::Isometry3d true_T_fisheye_color() {
  return Eigen::Translation3d(0.05, -0.03, 0.02) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, 1, -0.2).normalized());
}

/// The lens as calibrated before, from corners with `sigma_px`.
CameraCalibration known(const capture::CameraModel& camera, const std::vector<Eigen::Isometry3d>& poses,
                        double sigma_px) {
  std::vector<BoardPicture> pictures;
  for (BoardView& view : exact_views(test_board(), camera, poses, sigma_px, 77))
    pictures.push_back({{}, std::move(view)});
  return calibrate_camera(unknown_camera(camera), BoardFinder(test_board()), pictures);
}

TEST(CalibrateExtrinsics, OfDrawnPicturesToAMillimetreAndATenthOfADegree) {
  const capture::CameraModel color = distorted_pinhole(), fisheye = test_fisheye();
  const BoardFinder finder(test_board());
  const BoardDrawing before_color(test_board(), color), before_fisheye(test_board(), fisheye);
  const CameraCalibration first = known(color, pinhole_poses(16), 0.03), second = known(fisheye, fisheye_poses(), 0.03);
  ASSERT_EQ(first.refusal + second.refusal, "");
  std::array<std::vector<BoardView>, 2> views;
  BoardSensor sensor;
  for (const Eigen::Isometry3d& pose : pinhole_poses(8)) {
    const BoardPicture a = board_picture(finder, before_color.picture(pose, sensor));
    const BoardPicture b = board_picture(finder, before_fisheye.picture(true_T_fisheye_color() * pose, sensor));
    views[0].push_back(finder.again(a.view, a.light, first.model));
    views[1].push_back(finder.again(b.view, b.light, second.model));
    ++sensor.seed;
  }
  // The views of each lens alone still count, in addition to the common ones.
  for (BoardView& view : exact_views(test_board(), color, pinhole_poses(16), 0.03, 5)) {
    views[0].push_back(std::move(view));
    views[1].emplace_back();
  }
  for (BoardView& view : exact_views(test_board(), fisheye, fisheye_poses(), 0.03, 6)) {
    views[0].emplace_back();
    views[1].push_back(std::move(view));
  }
  const ExtrinsicsCalibration found = calibrate_extrinsics(first.model, second.model, views[0], views[1]);
  EXPECT_EQ(found.refusal, "");
  EXPECT_EQ(found.moments, 8);
  EXPECT_LT(millimetres_apart(found.T_second_first, true_T_fisheye_color()), 1.0);
  EXPECT_LT(degrees_apart(found.T_second_first, true_T_fisheye_color()), 0.1);
  std::printf("%.2f mm ± %.2f, %.3f° ± %.3f\n", millimetres_apart(found.T_second_first, true_T_fisheye_color()),
              1e3 * found.shift_sigma_m.norm(), degrees_apart(found.T_second_first, true_T_fisheye_color()),
              found.turn_sigma_rad.norm() / kTestDegree);
}

TEST(CalibrateExtrinsics, RefusesFewMomentsAndCamerasThatMoved) {
  const capture::CameraModel color = distorted_pinhole(), fisheye = test_fisheye();
  const auto extrinsics = [&](int moments, double moved_m) {
    std::vector<Eigen::Isometry3d> poses = pinhole_poses(moments), seen_by_fisheye;
    for (const Eigen::Isometry3d& pose : poses) {
      const Eigen::Isometry3d user_set(
          Eigen::Translation3d(moved_m * static_cast<double>(seen_by_fisheye.size() % 3), 0, 0));
      seen_by_fisheye.push_back(user_set * true_T_fisheye_color() * pose);
    }
    return calibrate_extrinsics(color, fisheye, exact_views(test_board(), color, poses, 0.05, 1),
                                exact_views(test_board(), fisheye, seen_by_fisheye, 0.05, 2))
        .refusal;
  };
  EXPECT_EQ(extrinsics(12, 0), "");
  EXPECT_EQ(extrinsics(4, 0).find("too few views: found 4 moments"), 0u) << extrinsics(4, 0);
  EXPECT_EQ(extrinsics(12, 0.02).find("residual: found"), 0u) << extrinsics(12, 0.02);
}

TEST(CalibrateExtrinsics, PlacesTheRoomsTag) {
  const capture::CameraModel color = distorted_pinhole(), fisheye = test_fisheye();
  Board tag = test_board();
  tag.rows = tag.columns = 1;
  tag.size_m = 0.16;
  const Eigen::Isometry3d T_color_tag = board_at(0.9, 0.15, 1, 0.8, 0.4, 0.2);
  const Eigen::Isometry3d T_fisheye_tag = true_T_fisheye_color() * T_color_tag;
  std::array<std::vector<SeenPoints>, 2> seen;
  for (unsigned i = 0; i < 6; ++i) {
    seen[0].push_back(exact_views(tag, color, {T_color_tag}, 0.03, i + 1)[0].seen.at(0));
    seen[1].push_back(exact_views(tag, fisheye, {T_fisheye_tag}, 0.03, i + 100)[0].seen.at(0));
  }
  const RoomTagPose both = place_room_tag(color, fisheye, true_T_fisheye_color(), seen);
  EXPECT_EQ(both.refusal, "");
  EXPECT_EQ(both.pictures, 12);
  EXPECT_LT(millimetres_apart(both.T_camera_tag, T_fisheye_tag), 2.0);
  EXPECT_LT(degrees_apart(both.T_camera_tag, T_fisheye_tag), 0.3);
  const RoomTagPose through_color = place_room_tag(color, fisheye, true_T_fisheye_color(), {seen[0], {}});
  EXPECT_EQ(through_color.refusal, "");
  EXPECT_LT(millimetres_apart(through_color.T_camera_tag, T_fisheye_tag), 2.0);
  const RoomTagPose alone = place_room_tag(color, fisheye, std::nullopt, seen);
  EXPECT_EQ(alone.pictures, 6);
  EXPECT_LT(millimetres_apart(alone.T_camera_tag, T_fisheye_tag), 6.0);
  EXPECT_EQ(place_room_tag(color, fisheye, std::nullopt, {seen[0], {}}).refusal, "no picture shows it");
}

}  // namespace
}  // namespace lumigraft::reconstruct
