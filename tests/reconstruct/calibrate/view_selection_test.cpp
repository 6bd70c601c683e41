// Selection of moments: the board is still, and at a new position.
#include "reconstruct/calibrate/view_selection.h"

#include <gtest/gtest.h>

#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::reconstruct {
namespace {

using namespace test;

class CalibrateCollect : public testing::Test {
 protected:
  CalibrateCollect() : drawing_(board(), camera()), collector_(board(), std::nullopt) {}

  static Board board() {
    Board one = test_board();
    one.rows = one.columns = 2;
    return one;
  }
  static capture::CameraModel camera() {
    capture::CameraModel small;
    small.width = 160;
    small.height = 120;
    small.fx = small.fy = 130;
    small.cx = 79.5;
    small.cy = 59.5;
    return small;
  }
  bool add(double time_s, double right_m) {
    Eigen::Isometry3d pose = board_at(0.25, 0, 0, 0.3);
    pose.translation().x() += right_m;
    const capture::Frame picture = drawing_.picture(pose, {});
    return collector_
        .add(static_cast<std::int64_t>(1e9 * time_s), &picture, capture::Response::srgb(), {},
             capture::Response::srgb())
        .kept;
  }

  BoardDrawing drawing_;
  ViewSelector collector_;
};

TEST_F(CalibrateCollect, OnlyWhatIsNew) {
  EXPECT_TRUE(add(1, 0));
  EXPECT_FALSE(add(2, 0.001));
  EXPECT_TRUE(add(3, 0.04));
  EXPECT_FALSE(add(4, 0));
  ASSERT_EQ(collector_.moments().size(), 2u);
  EXPECT_EQ(collector_.moments()[0].by_camera[0].view.seen.size(), 4u);
  EXPECT_TRUE(collector_.moments()[0].by_camera[1].light.empty());
}

TEST_F(CalibrateCollect, OnlyABoardThatIsStill) {
  EXPECT_TRUE(add(1.0, 0));
  EXPECT_FALSE(add(1.2, 0.03)) << "on its way";
  EXPECT_FALSE(add(1.25, 0.03)) << "not looked at so soon";
  EXPECT_TRUE(add(1.45, 0.03)) << "arrived";
  EXPECT_TRUE(add(9.0, -0.03)) << "pictures that are no sequence";
}

TEST_F(CalibrateCollect, NothingWhereThereIsNoBoard) {
  EXPECT_FALSE(add(1, 1.0));
  EXPECT_TRUE(collector_.moments().empty());
}

TEST_F(CalibrateCollect, ClippedPaperSaysNothingAboutLight) {
  for (const float exposure : {1.0f, 1.6f}) {
    ViewSelector collector(board(), std::nullopt);
    capture::Image<float> light = drawing_.light(board_at(0.25, 0, 0, 0.3), {});
    for (float& value : light.data) value *= exposure;
    const capture::Frame picture = encoded(light);
    ASSERT_TRUE(collector.add(0, &picture, capture::Response::srgb(), {}, capture::Response::srgb()).kept);
    const auto& board_picture = collector.moments().at(0).by_camera[0];
    ASSERT_EQ(board_picture.view.seen.size(), 4u);
    const BoardView again = collector.finder().again(board_picture.view, board_picture.light, camera());
    for (const BoardView& view : {board_picture.view, again})
      for (const SeenPoints& tag : view.seen) EXPECT_NEAR(tag.paper, exposure > 1 ? 0 : 0.75, 0.02);
  }
}

TEST_F(CalibrateCollect, ThePathHoldsTheMovingBoardToo) {
  for (int i = 0; i < 5; ++i) add(0.2 * i, 0.01 * i);
  EXPECT_LT(collector_.moments().size(), 5u);
  ASSERT_EQ(collector_.path(0).size(), 5u);
  EXPECT_TRUE(collector_.path(1).empty());
}

}  // namespace
}  // namespace lumigraft::reconstruct
