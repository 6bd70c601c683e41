#include "relight/views/view_projection.h"

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

capture::CameraModel distorted(const std::array<double, 5>& coefficients) {
  capture::CameraModel camera = session_of(320, 240, 250).color.model;
  camera.distortion = coefficients;
  return camera;
}

TEST(ViewProjection, IsThatOfTheCameraModelWithinTheImage) {
  const Eigen::Isometry3f T_tag_camera =
      Eigen::Translation3f(0.1f, -0.2f, 0.3f) * Eigen::AngleAxisf(0.4f, Vector3f(1, 2, 3).normalized());
  capture::CameraModel fisheye = session_of(320, 240, 150).color.model;
  fisheye.kind = capture::CameraModel::Kind::equidistant;
  fisheye.fov_rad = 3;
  for (const capture::CameraModel& camera :
       {session_of(320, 240, 250).color.model, distorted({-0.3, 0.08, 0.002, -0.001, 0.01}), fisheye}) {
    const relight::ViewProjection projection(camera, T_tag_camera);
    for (int v = 0; v < camera.height; v += 8) {
      for (int u = 0; u < camera.width; u += 8) {
        const auto w = camera.unproject({u, v});
        if (!w) continue;
        const auto pixel = projection.pixel(T_tag_camera * Vector3f(1.7f * w->cast<float>()));
        ASSERT_TRUE(pixel) << u << ", " << v;
        EXPECT_LT((*pixel - Eigen::Vector2f(u, v)).norm(), 2e-3f) << u << ", " << v;
      }
    }
    EXPECT_EQ(projection.pixel(T_tag_camera * Vector3f(0, 0, -1)).has_value(), camera.project({0, 0, -1}).has_value());
  }
}

TEST(ViewProjection, SeesNothingWhereDistortionFoldsTheImageBack) {
  const capture::CameraModel camera = distorted({-0.3});  // at 46 degrees
  const relight::ViewProjection projection(camera, Eigen::Isometry3f::Identity());
  EXPECT_FALSE(camera.project({1.1, 0, 1}));
  for (int degrees = 0; degrees < 85; degrees += 5) {
    const double angle_rad = degrees * M_PI / 180;
    const Eigen::Vector3d w(std::sin(angle_rad), 0, std::cos(angle_rad));
    EXPECT_EQ(projection.pixel(w.cast<float>()).has_value(), camera.project(w).has_value()) << degrees;
  }
}

}  // namespace
}  // namespace lumigraft::test
