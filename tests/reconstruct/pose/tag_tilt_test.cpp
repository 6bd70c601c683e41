// A tag's tilt by its print, and by the depth of the surface on which it lies.
#include "reconstruct/pose/tag_tilt.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;
using test::some_tag;

double tilt_degrees(const Isometry3d& T_tag_camera, const Isometry3d& truth) {
  const Vector3d up = Vector3d::UnitZ();
  const double cosine = (T_tag_camera.linear().transpose() * up).dot(truth.linear().transpose() * up);
  return std::acos(std::min(1.0, cosine)) / kDegree;
}

capture::FrameSet seen(const capture::CameraModel& lens, const Isometry3d& T_tag_camera, unsigned seed,
                       double depth_noise) {
  const TagFinder finder(some_tag());
  capture::FrameSet frame =
      test::frame_of(test::view_of_tag(lens, finder.pattern(), 0.16, T_tag_camera, {1, seed}), 0, 0);
  frame.depth = std::make_shared<capture::DepthFrame>(
      test::depth_of_table(test::small_camera(), T_tag_camera, seed, depth_noise));
  return frame;
}

// The lens bends the image's border by pixels that its calibration does not contain.
TEST(TagTilt, DepthCorrectsAPrintThatALensBends) {
  capture::CameraModel bent = test::small_camera();
  bent.distortion[0] = 0.12;
  double worst_alone = 0, worst_corrected = 0, worst_sigmas = 0;
  for (unsigned i = 0; i < 12; ++i) {
    const double azimuth = 0.5 * i;
    const Vector3d aim(0.28 * std::cos(2.4 * i), 0.28 * std::sin(2.4 * i), 0);  // the tag is off the middle
    const Isometry3d truth = test::looking_at_tag(1.0, 35 * kDegree, azimuth, aim);
    capture::FrameSet frame = seen(bent, truth, i + 1, 1);
    const auto corrected = PoseStage(some_tag(), test::small_camera()).locate(frame);
    frame.depth = nullptr;
    const auto alone = PoseStage(some_tag(), test::small_camera()).locate(frame);
    ASSERT_TRUE(alone.pose && corrected.pose) << i;
    worst_alone = std::max(worst_alone, tilt_degrees(alone.pose->T_tag_camera, truth));
    const double tilt = tilt_degrees(corrected.pose->T_tag_camera, truth);
    worst_corrected = std::max(worst_corrected, tilt);
    worst_sigmas = std::max(worst_sigmas, tilt * kDegree / angle_sigma_rad(corrected.pose->covariance));
  }
  std::printf("tag tilt: bent lens: %.2f deg by the print, %.2f deg with depth, at most %.1f sigma\n", worst_alone,
              worst_corrected, worst_sigmas);
  EXPECT_GT(worst_alone, 1.2);
  EXPECT_LT(worst_corrected, 0.5);
  EXPECT_LT(worst_sigmas, 3);
}

// With a lens that is calibrated the print is better than depth, which then hardly moves it.
TEST(TagTilt, DepthDoesNotSpoilAnExactPrint) {
  double squares_with = 0, squares_without = 0;
  for (unsigned i = 0; i < 24; ++i) {
    const Isometry3d truth = test::looking_at_tag(0.9, (15 + 2 * i) * kDegree, 0.5 * i);
    capture::FrameSet frame = seen(test::small_camera(), truth, i + 1, 1);
    const auto with = PoseStage(some_tag(), test::small_camera()).locate(frame);
    frame.depth = nullptr;
    const auto without = PoseStage(some_tag(), test::small_camera()).locate(frame);
    ASSERT_TRUE(with.pose && without.pose) << i;
    squares_with += std::pow(tilt_degrees(with.pose->T_tag_camera, truth), 2);
    squares_without += std::pow(tilt_degrees(without.pose->T_tag_camera, truth), 2);
  }
  std::printf("tag tilt: exact lens: RMS %.3f deg by the print, %.3f deg with depth\n", std::sqrt(squares_without / 24),
              std::sqrt(squares_with / 24));
  EXPECT_LT(squares_with, 1.01 * squares_without);
}

// The plane around the tag ends where the table does: a lower floor is not taken for it.
TEST(TagTilt, TheSurfaceEndsAtTheTablesEdge) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::looking_at_tag(0.9, 40 * kDegree, -1.2);
  const capture::DepthFrame depth =
      test::depth_picture(camera, truth, 3, 1, [](const Vector3d& from, const Vector3d& d) {
        const Vector3d on_table = from - from.z() / d.z() * d;
        const bool table = std::abs(on_table.x()) < 0.2 && std::abs(on_table.y()) < 0.2;
        return table ? -from.z() / d.z() : -(from.z() + 0.1) / d.z();
      });
  TagCorners corners;
  const double half = 0.08;
  const Vector3d square[4] = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  for (int i = 0; i < 4; ++i) corners[i] = *camera.project(truth.inverse() * square[i]);
  const auto plane = plane_around(depth.depth_m, camera, corners);
  ASSERT_TRUE(plane);
  const double off = std::acos(plane->normal.dot(truth.linear().transpose() * Vector3d::UnitZ()));
  EXPECT_LT(off / kDegree, 0.6);
  EXPECT_LT(off, 3 * std::sqrt(plane->covariance.trace()));
}

}  // namespace
}  // namespace lumigraft::reconstruct
