#include "reconstruct/math/planar_pose.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

SquareCorners project(const Isometry3d& T_camera_tag, double size_m) {
  const double h = size_m / 2;
  SquareCorners corners;
  const Vector3d tag[4] = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
  for (int i = 0; i < 4; ++i) corners[i] = (T_camera_tag * tag[i]).hnormalized();
  return corners;
}

TEST(PoseSolver, ExactCornersGiveTheExactPose) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 200; ++i) {
    const Isometry3d truth = test::looking_at_tag(0.4 + 2 * uniform(random), 1.3 * uniform(random),
                                                  2 * M_PI * uniform(random), {0.1 * uniform(random), 0.1, 0});
    const auto poses = solve_square(project(truth.inverse(), 0.16), 0.16);
    ASSERT_FALSE(poses.empty());
    EXPECT_LT(poses[0].error, 1e-8);
    EXPECT_LT(test::millimetres_apart(poses[0].T_camera_tag.inverse(), truth), 1e-2);
    EXPECT_LT(test::degrees_apart(poses[0].T_camera_tag.inverse(), truth), 1e-3);
  }
}

TEST(PoseSolver, BothPosesOfATiltedTagAreMinima) {
  const Isometry3d truth = test::looking_at_tag(1.5, 20 * M_PI / 180, 0.7);
  const SquareCorners corners = project(truth.inverse(), 0.16);
  const auto poses = solve_square(corners, 0.16);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_GT(test::degrees_apart(poses[0].T_camera_tag, poses[1].T_camera_tag), 20);
  // No small turn or shift lowers the error of either.
  for (const PlanarPose& pose : poses)
    for (int axis = 0; axis < 6; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        Isometry3d other = pose.T_camera_tag;
        if (axis < 3)
          other.linear() = Eigen::AngleAxisd(sign * 1e-3, Vector3d::Unit(axis)) * other.linear();
        else
          other.translation() += sign * 1e-3 * Vector3d::Unit(axis - 3);
        EXPECT_GE(square_error(other, corners, 0.16), pose.error - 1e-12);
      }
}

TEST(PoseSolver, OneOfThePosesOfNoisyCornersIsTheTruth) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.3 / 262.5);
  int second = 0;
  for (int i = 0; i < 200; ++i) {
    const Isometry3d truth = test::looking_at_tag(2.5, 15 * M_PI / 180, 0.03 * i);
    SquareCorners corners = project(truth.inverse(), 0.16);
    for (Vector2d& corner : corners) corner += Vector2d(noise(random), noise(random));
    const auto poses = solve_square(corners, 0.16);
    ASSERT_FALSE(poses.empty());
    double nearest = 180;
    for (const PlanarPose& pose : poses)
      nearest = std::min(nearest, test::degrees_apart(pose.T_camera_tag.inverse(), truth));
    EXPECT_LT(nearest, 30) << i;
    second += poses.size() == 2 && test::degrees_apart(poses[0].T_camera_tag.inverse(), truth) > nearest;
  }
  EXPECT_GT(second, 20) << "else the corners alone would be enough";
}

TEST(PoseSolver, CornersOnALineHaveNoPose) {
  EXPECT_TRUE(solve_square({Vector2d(0, 0), Vector2d(0.1, 0), Vector2d(0.2, 0), Vector2d(0.3, 0)}, 0.16).empty());
}

}  // namespace
}  // namespace lumigraft::reconstruct
