// Fish-eye calibration from real pictures of a chessboard. LUMIGRAFT_EXTRA names a folder that contains
// data/fisheye-calib.
#include <gtest/gtest.h>

#include <cstdlib>

#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::reconstruct {
namespace {

TEST(CalibrateReal, AChessboardBeforeAFisheye) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const std::filesystem::path folder = extra ? std::filesystem::path(extra) / "data/fisheye-calib/fish_1" : "";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/fisheye-calib/fish_1";
  Board board;
  board.kind = Board::Kind::chessboard;
  board.rows = 8;
  board.columns = 6;
  board.size_m = 0.03;
  const BoardFinder finder(board);
  std::vector<BoardPicture> pictures;
  capture::CameraModel camera;
  camera.kind = capture::CameraModel::Kind::kannala_brandt;
  for (const auto& file : picture_files(folder)) {
    const capture::Frame picture = read_any_picture(file);
    camera.width = picture.encoded.width;
    camera.height = picture.encoded.height;
    BoardPicture& kept = pictures.emplace_back();
    kept.light = linear_light(picture, capture::Response::srgb());
    kept.view = finder.find(detector_codes(picture, {0, 0, camera.width, camera.height}, 1.0f), kept.light);
  }
  const CameraCalibration found = calibrate_camera(camera, finder, pictures);
  std::printf("%d views, %d corners, %d left out; %.3f px in the median, 95 %% below %.3f px; f %.2f ± %.2f px\n",
              found.views, found.corners, found.outliers, found.median_px, found.percent95_px, found.model.fx,
              found.sigma[0]);
  EXPECT_EQ(found.refusal, "");
  EXPECT_EQ(found.views, 15);
  EXPECT_LT(found.median_px, 0.4);
  EXPECT_LT(found.percent95_px, 0.9);
  EXPECT_LE(found.outliers, 10);
}

}  // namespace
}  // namespace lumigraft::reconstruct
