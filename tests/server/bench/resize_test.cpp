#include "server/bench/resize.h"

#include <gtest/gtest.h>

#include <memory>

namespace lumigraft::server {
namespace {

TEST(BenchResize, AnEnlargedPictureShrinksToItself) {
  auto color = std::make_shared<capture::Frame>();
  color->encoded = capture::Image<std::uint8_t>(5, 4, 3);
  for (std::size_t i = 0; i < color->encoded.data.size(); ++i)
    color->encoded.data[i] = static_cast<std::uint8_t>(i * 37);
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->depth_m = capture::Image<float>(5, 4, 1, 2.0f);
  capture::FrameSet frame;
  frame.color = color;
  frame.depth = depth;
  capture::CameraModel camera;
  camera.width = 5;
  camera.height = 4;
  camera.fx = camera.fy = 6;
  camera.cx = 2;
  camera.cy = 1.5;
  const capture::CameraModel small = camera;
  resize_picture(2, camera, frame);
  EXPECT_EQ(camera.width, 10);
  EXPECT_EQ(frame.depth->depth_m.height, 8);
  EXPECT_EQ(shrunk(frame.color->encoded, 2).data, color->encoded.data);
  EXPECT_EQ(shrunk(color->encoded, 1).data, color->encoded.data);
  // The corner between 2 × 2 new pixels has the direction of the old pixel's centre.
  EXPECT_TRUE(camera.unproject({2.5, 4.5})->normalized().isApprox(small.unproject({1, 2})->normalized()));
}

TEST(BenchResize, LightIsAveragedNotCodes) {
  capture::Image<std::uint8_t> picture(2, 2, 3);
  picture.at(0, 0, 0) = picture.at(1, 0, 0) = 255;
  EXPECT_EQ(shrunk(picture, 2).at(0, 0, 0), 188);  // mean of linear light
}

}  // namespace
}  // namespace lumigraft::server
