// Corners of rendered tags, compared with the camera model.
#include "reconstruct/calibrate/corners.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "reconstruct/calibrate/lens.h"
#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

TEST(CalibrateLens, ProjectsAsTheCameraModelDoes) {
  for (const capture::CameraModel& camera : {distorted_pinhole(), test_fisheye()}) {
    const LensNumbers lens = lens_numbers(camera);
    const bool pinhole = camera.kind == capture::CameraModel::Kind::pinhole;
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0.3, -0.2, 1),
                                     Eigen::Vector3d(-1, 0.5, 2), Eigen::Vector3d(0.1, 1e-9, 0.4)}) {
      Eigen::Vector2d pixel;
      ASSERT_TRUE(project_through(pinhole, lens.data(), p, pixel));
      EXPECT_LT((pixel - *camera.project(p)).norm(), 1e-9);
    }
    const capture::CameraModel same = with_lens(camera, lens);
    EXPECT_EQ(same.distortion, camera.distortion);
    EXPECT_EQ(same.k, camera.k);
  }
  Eigen::Vector2d pixel;
  EXPECT_TRUE(project_through(false, lens_numbers(test_fisheye()).data(), Eigen::Vector3d(1, 0.2, -0.05), pixel));
  EXPECT_LT((pixel - *test_fisheye().project({1, 0.2, -0.05})).norm(), 1e-9) << "behind the fish-eye's plane";
  EXPECT_FALSE(project_through(true, lens_numbers(distorted_pinhole()).data(), Eigen::Vector3d(0, 0, -1), pixel));
}

Board one_tag() {
  Board board = test_board();
  board.rows = board.columns = 1;
  return board;
}

/// Corners of one tag estimated from a start with half a pixel of error, and the true corners.
struct Found {
  std::optional<PrintCorners> corners;
  TagCorners truth;
};
Found find(const capture::CameraModel& camera, const Eigen::Isometry3d& pose, const BoardSensor& sensor,
           bool lens_known) {
  const Board board = one_tag();
  const BoardDrawing drawing(board, camera);
  const TagFinder finder(board.tag_list());
  Found found;
  TagCorners start;
  for (std::size_t i = 0; i < 4; ++i) {
    found.truth[i] = *camera.project(pose * board.corners_m(0)[i]);
    start[i] = found.truth[i] + Eigen::Vector2d(i % 2 == 0 ? 0.5 : -0.4, i < 2 ? -0.3 : 0.5);
  }
  const auto light = linear_light(drawing.picture(pose, sensor), capture::Response::srgb());
  found.corners = print_corners(light, finder.pattern(), start, lens_known ? &camera : nullptr);
  return found;
}

double worst_px(const Found& found) {
  double worst = 0;
  for (std::size_t i = 0; i < 4; ++i) worst = std::max(worst, (found.corners->pixels[i] - found.truth[i]).norm());
  return worst;
}

TEST(CalibrateCorners, AreFoundToHundredthsOfAPixelUnderAnyBlur) {
  for (const double blur_px : {0.3, 0.5, 1.0}) {
    BoardSensor sensor;
    sensor.blur_px = blur_px;
    const Found found = find(distorted_pinhole(), board_at(0.5, 0.2, 1, 0.5, 2, 0.3), sensor, true);
    ASSERT_TRUE(found.corners) << blur_px;
    EXPECT_LT(worst_px(found), 0.05) << blur_px;
  }
}

/// Without a lens model edges are assumed straight; with it, curved as the lens shows them.
TEST(CalibrateCorners, FollowBentEdgesOnceTheLensIsKnown) {
  const Eigen::Isometry3d pose = board_at(0.25, 70 * kTestDegree, 0.7, 0.2, 0.5, 0.6);
  const Found first = find(test_fisheye(), pose, {}, false), again = find(test_fisheye(), pose, {}, true);
  ASSERT_TRUE(first.corners);
  ASSERT_TRUE(again.corners);
  EXPECT_LT(worst_px(first), 2.0);
  EXPECT_GT(worst_px(first), 0.1);
  EXPECT_LT(worst_px(again), 0.05);
}

/// The covariance of the eight coordinates: over many noise realisations, whitened errors have unit variance.
TEST(CalibrateCorners, KnowHowSureTheyAre) {
  constexpr int kSeeds = 12;
  const Eigen::Isometry3d pose = board_at(0.6, 0.2, 1, 0.5, 2, 0.3);
  BoardSensor sensor;
  sensor.electrons = 600;  // noise larger than the error of the box-shaped blur model
  Eigen::Matrix<double, 8, kSeeds> errors;
  double sum = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    sensor.seed = static_cast<unsigned>(seed + 1);
    const Found found = find(distorted_pinhole(), pose, sensor, true);
    ASSERT_TRUE(found.corners);
    for (int i = 0; i < 4; ++i)
      errors.col(seed).segment<2>(2 * i) =
          found.corners->pixels[static_cast<std::size_t>(i)] - found.truth[static_cast<std::size_t>(i)];
    sum += errors.col(seed).dot(found.corners->covariance.ldlt().solve(errors.col(seed)));
  }
  const double mean = sum / (8 * kSeeds);  // mean square: about 1, because paper is noisier than ink
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(mean, 2.0);
}

TEST(CalibrateCorners, AreNotFoundWhereNoTagIs) {
  const Board board = one_tag();
  const TagFinder finder(board.tag_list());
  const capture::Image<std::uint16_t> flat(200, 200, 1, 30000);
  const TagCorners start = {Eigen::Vector2d(50, 150), {150, 150}, {150, 50}, {50, 50}};
  EXPECT_FALSE(print_corners(flat, finder.pattern(), start, nullptr));
  const TagCorners outside = {Eigen::Vector2d(150, 250), {250, 250}, {250, 150}, {150, 150}};
  EXPECT_FALSE(print_corners(flat, finder.pattern(), outside, nullptr));
}

/// Over three views of a board: mean displacement of corners towards their tag's centre, and RMS errors in units of the
/// reported 1σ.
struct SharedError {
  double inwards_px = 0, edge_px = 0, of_said = 0;
  int tags = 0;
};
/// The board is `gain` times as bright; the picture is clipped at 1.
SharedError shared_error(const capture::CameraModel& camera, double far_m, double blur_px, double gain = 1) {
  const BoardFinder finder(test_board());
  const BoardDrawing drawing(test_board(), camera);
  SharedError sum;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Eigen::Isometry3d pose = board_at(far_m, 0.2, 2.4 * seed, 0.2 + 0.1 * seed, 1.3 * seed, 0.4 * seed);
    capture::Image<float> light = drawing.light(pose, {.blur_px = blur_px, .electrons = 14000 / gain, .seed = seed});
    for (float& value : light.data) value *= static_cast<float>(gain);
    const BoardPicture seen = board_picture(finder, encoded(light));
    for (const SeenPoints& tag : finder.again(seen.view, seen.light, camera).seen) {
      Eigen::Vector2d middle = Eigen::Vector2d::Zero(), true_middle = middle;
      Eigen::VectorXd error(8);
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector2d truth = *camera.project(pose * tag.points_m[i]);
        error.segment<2>(2 * static_cast<Eigen::Index>(i)) = tag.pixels[i] - truth;
        middle += tag.pixels[i] / 4;
        true_middle += truth / 4;
      }
      for (std::size_t i = 0; i < 4; ++i) {
        const double truth_px = (*camera.project(pose * tag.points_m[i]) - true_middle).norm();
        sum.inwards_px += (truth_px - (tag.pixels[i] - middle).norm()) / 4;
        sum.edge_px += truth_px / 4 * std::sqrt(2.0);
      }
      sum.of_said += (tag.whitening * error).squaredNorm() / 8;
      ++sum.tags;
    }
  }
  const int tags = std::max(sum.tags, 1);
  return {sum.inwards_px / tags, sum.edge_px / tags, std::sqrt(sum.of_said / tags), sum.tags};
}

/// A systematic error of all tags does not average out: the covariance of an extrinsic calibration cannot contain it.
TEST(CalibrateCorners, SmallTagsSeemNeitherSmallerNorLarger) {
  for (const capture::CameraModel& camera : {distorted_pinhole(), test_fisheye()}) {
    const double far_m = camera.kind == capture::CameraModel::Kind::pinhole ? 1.5 : 0.45;
    for (const double blur_px : {0.35, 0.5, 0.8}) {
      const SharedError found = shared_error(camera, far_m, blur_px);
      ASSERT_GT(found.tags, 15);
      std::printf("tags of %.1f px, blur %.2f px: corners inwards by %.4f px; errors %.2f of what is said\n",
                  found.edge_px, blur_px, found.inwards_px, found.of_said);
      EXPECT_LT(std::abs(found.inwards_px), 0.015);
      EXPECT_LT(found.of_said, 1.0);
    }
  }
}

/// With clipped values taken as exact, every corner moves inward by 0.1 to 0.7 px.
TEST(CalibrateCorners, PaperThatIsCutOffDrawsNoTagSmaller) {
  for (const capture::CameraModel& camera : {distorted_pinhole(), test_fisheye()}) {
    const double far_m = camera.kind == capture::CameraModel::Kind::pinhole ? 0.6 : 0.25;
    for (const double gain : {1.6, 2.0, 4.0}) {
      const SharedError found = shared_error(camera, far_m, 0.5, gain);
      ASSERT_GT(found.tags, 15);
      std::printf("paper %.1f times as bright: corners inwards by %.4f px; errors %.2f of what is said\n", gain,
                  found.inwards_px, found.of_said);
      EXPECT_LT(std::abs(found.inwards_px), 0.015);
      EXPECT_LT(found.of_said, 1.5);
    }
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
