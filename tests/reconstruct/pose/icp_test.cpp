#include "reconstruct/pose/icp.h"

#include <gtest/gtest.h>

#include <ctime>

#include "tests/reconstruct/pose/pose_room.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;

/// 1σ of `position_m` and `angle_rad` along each axis.
PoseCovariance covariance(double position_m, double angle_rad) {
  PoseCovariance result = PoseCovariance::Zero();
  result.topLeftCorner<3, 3>().diagonal().setConstant(position_m * position_m);
  result.bottomRightCorner<3, 3>().diagonal().setConstant(angle_rad * angle_rad);
  return result;
}

Isometry3d off_by(const Isometry3d& pose, const Vector3d& shift_m, const Vector3d& turn_rad) {
  Eigen::Matrix<double, 6, 1> step;
  step << shift_m, turn_rad;
  return apply_step(pose, step);
}

class Icp : public testing::Test {
 protected:
  const capture::CameraModel camera = test::small_camera();
  const DepthSampler sampler{camera};
  const Isometry3d truth = test::looking_at_tag(1.3, 50 * kDegree, -1.2, {0.0, 0.15, 0.1});
};

TEST(PoseCovariance, StepsLeadFromOnePoseToAnother) {
  const Isometry3d a = test::looking_at_tag(1.3, 0.8, -1.2), b = test::looking_at_tag(1.1, 0.5, 0.3);
  EXPECT_LT((apply_step(a, step_between(a, b)).matrix() - b.matrix()).norm(), 1e-12);
  EXPECT_LT(step_between(a, a).norm(), 1e-12);
}

TEST_F(Icp, GridPointsLieOnTheSurface) {
  const TestRoom room = test::furnished_room();
  const DepthGrid grid = sampler.sample(test::depth_of_room(room, camera, truth, 1, 0).depth_m);
  ASSERT_EQ(grid.columns, 80);
  ASSERT_EQ(grid.rows, 60);
  int points = 0, normals = 0, off = 0, slanted = 0;
  for (const DepthGrid::Point& point : grid.points) {
    if (point.position.z() == 0) continue;
    ++points;
    const Eigen::Vector3f position = truth.cast<float>() * point.position;
    off += std::abs(room.distance(position)) > 1e-3f;
    if (point.normal.isZero()) continue;
    ++normals;
    slanted += (truth.linear().cast<float>() * point.normal).dot(room.normal(position)) < 0.95f;
  }
  EXPECT_GT(points, 3000);
  EXPECT_LT(off, 0.02 * points) << "at creases";
  EXPECT_LT(slanted, 0.02 * points) << "at creases";
  EXPECT_GT(normals, 0.8 * points);
}

TEST_F(Icp, AlignmentToTheFieldFindsThePose) {
  const TestRoom room = test::furnished_room();
  const DistanceField field = room.field();
  for (const double noise : {0.0, 1.0}) {
    const DepthGrid grid = sampler.sample(test::depth_of_room(room, camera, truth, 1, noise).depth_m);
    const Isometry3d start = off_by(truth, {0.012, -0.01, 0.008}, {0.006, -0.005, 0.007});
    const std::clock_t begin = std::clock();
    const auto fit = align_to_field(grid, field, {start, covariance(0.02, 0.02)});
    const double cpu_ms = 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    ASSERT_TRUE(fit);
    const double away_mm = test::millimetres_apart(fit->pose.T_tag_camera, truth);
    const double away_degrees = test::degrees_apart(fit->pose.T_tag_camera, truth);
    const auto error = step_between(fit->pose.T_tag_camera, truth);
    std::printf("pose: depth noise %.0f: %.2f mm, %.3f deg from truth, sigma %.2f mm, %.3f deg; %.2f CPU ms\n", noise,
                away_mm, away_degrees, 1e3 * position_sigma_m(fit->pose.covariance),
                angle_sigma_rad(fit->pose.covariance) / kDegree, cpu_ms);
    EXPECT_LT(away_mm, noise > 0 ? 2.5 : 1.0);
    EXPECT_LT(away_degrees, noise > 0 ? 0.12 : 0.06);
    EXPECT_LT(squared_mahalanobis(error, fit->pose.covariance), 22)
        << "99.9 % quantile of chi-squared with 6 degrees of freedom";
    EXPECT_GT(fit->inlier_fraction, 0.5);
  }
}

// A floor determines its distance and two tilts, but no translation along it and no rotation about its normal.
TEST_F(Icp, UndeterminedDirectionsKeepThePrior) {
  TestRoom room;
  room.half_m = 0.9f;
  const Isometry3d above = test::looking_at_tag(0.8, 5 * kDegree, 0.4);
  const DepthGrid grid = sampler.sample(test::depth_of_room(room, camera, above, 1, 0).depth_m);
  const Isometry3d start = off_by(above, {0.01, 0.0, 0.012}, {0.005, 0.0, 0.01});
  const auto fit = align_to_field(grid, room.field(), {start, covariance(0.02, 0.02)});
  ASSERT_TRUE(fit);
  const auto left = step_between(fit->pose.T_tag_camera, above);
  EXPECT_NEAR(left[2], 0, 3e-4);
  EXPECT_NEAR(left[3], 0, 5e-4);
  EXPECT_NEAR(left[4], 0, 5e-4);
  EXPECT_NEAR(left[0], -0.01, 1e-3);
  EXPECT_NEAR(left[5], -0.01, 1e-3);
  const auto sigma = fit->pose.covariance.diagonal().cwiseSqrt().eval();
  EXPECT_GT(sigma[0], 0.015);
  EXPECT_GT(sigma[1], 0.015);
  EXPECT_GT(sigma[5], 0.015);
  EXPECT_LT(sigma[2], 0.002);
  EXPECT_LT(sigma[3], 0.003);
}

TEST_F(Icp, AnArmInFrontOfTheRoomIsAnOutlier) {
  const TestRoom room = test::furnished_room();
  capture::DepthFrame depth = test::depth_of_room(room, camera, truth, 1, 1);
  for (int v = 60; v < 240; ++v)
    for (int u = 100; u < 170; ++u) depth.depth_m.at(u, v) = 0.6f;
  const Isometry3d start = off_by(truth, {0.005, -0.004, 0.006}, {0.003, -0.003, 0.003});
  const auto fit = align_to_field(sampler.sample(depth.depth_m), room.field(), {start, covariance(0.02, 0.02)});
  ASSERT_TRUE(fit);
  EXPECT_LT(test::millimetres_apart(fit->pose.T_tag_camera, truth), 3);
  EXPECT_LT(test::degrees_apart(fit->pose.T_tag_camera, truth), 0.15);
}

TEST_F(Icp, WithoutSurfaceThereIsNoPose) {
  const TestRoom room = test::furnished_room();
  const DepthGrid grid = sampler.sample(test::depth_of_room(room, camera, truth, 1, 0).depth_m);
  EXPECT_FALSE(align_to_field(grid, DistanceField(), {truth, covariance(0.02, 0.02)}));
  EXPECT_FALSE(align_to_field(sampler.sample(capture::Image<float>(320, 240, 1)), room.field(),
                              {truth, covariance(0.02, 0.02)}));
  EXPECT_FALSE(align_to_field(sampler.sample(capture::Image<float>(640, 480, 1)), room.field(),
                              {truth, covariance(0.02, 0.02)}));
}

TEST_F(Icp, AlignmentToAnEarlierFrameReachesFar) {
  const TestRoom room = test::furnished_room();
  const DepthGrid earlier = sampler.sample(test::depth_of_room(room, camera, truth, 1, 1).depth_m);
  const Isometry3d now = off_by(truth, {0.06, -0.03, 0.02}, {0.04, -0.05, 0.03});
  const DepthGrid grid = sampler.sample(test::depth_of_room(room, camera, now, 2, 1).depth_m);
  const Isometry3d near = align_to_frame(grid, earlier, camera, truth, {truth, covariance(0.1, 0.1)});
  std::printf("pose: %.0f mm and %.1f deg away, %.1f mm and %.2f deg after the earlier picture\n",
              test::millimetres_apart(truth, now), test::degrees_apart(truth, now), test::millimetres_apart(near, now),
              test::degrees_apart(near, now));
  EXPECT_LT(test::millimetres_apart(near, now), 15);
  EXPECT_LT(test::degrees_apart(near, now), 0.8);
  const auto fit = align_to_field(grid, room.field(), {near, covariance(0.02, 0.02)});
  ASSERT_TRUE(fit);
  EXPECT_LT(test::millimetres_apart(fit->pose.T_tag_camera, now), 3);
}

}  // namespace
}  // namespace lumigraft::reconstruct
