// Every step-th pixel of a depth image, and the camera whose pixels they are.
#include "relight/compose/sampled_depth.h"

#include <gtest/gtest.h>

namespace lumigraft::relight {
namespace {

TEST(SampledDepth, SamplesLieOnTheRaysOfTheirPixels) {
  capture::CameraModel camera;
  camera.width = 33;
  camera.height = 20;
  camera.fx = 40;
  camera.fy = 42;
  camera.cx = 15.7;
  camera.cy = 10.2;
  camera.distortion = {-0.1, 0.02, 0.001, -0.002, 0};
  capture::Image<float> depth_m(camera.width, camera.height, 1);
  for (std::size_t i = 0; i < depth_m.data.size(); ++i) depth_m.data[i] = static_cast<float>(i);
  for (const int step : {1, 2, 3, 5}) {
    SCOPED_TRACE(step);
    SampledDepth sampled(camera, step);
    const capture::Image<float>& samples = sampled.sample(depth_m);
    ASSERT_EQ(samples.width, sampled.model().width);
    ASSERT_EQ(samples.height, sampled.model().height);
    EXPECT_EQ(samples.width, (camera.width + step - 1 - step / 2) / step);
    for (int v = 0; v < samples.height; ++v) {
      for (int u = 0; u < samples.width; ++u) {
        const auto pixel = camera.project(*sampled.model().unproject(Eigen::Vector2d(u, v)));
        ASSERT_TRUE(pixel);
        const Eigen::Vector2i at = pixel->array().round().cast<int>();
        EXPECT_LT((*pixel - at.cast<double>()).norm(), 1e-4);
        EXPECT_EQ(samples.at(u, v), depth_m.at(at.x(), at.y()));
      }
    }
  }
}

}  // namespace
}  // namespace lumigraft::relight
