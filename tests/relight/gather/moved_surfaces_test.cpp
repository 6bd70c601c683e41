// Which differences between this frame's depth and the fused room are surface that moved.
#include "relight/gather/moved_surfaces.h"

#include <gtest/gtest.h>

#include <memory>

namespace lumigraft::relight {
namespace {

/// Pixels of a fused room at 1 m, where this frame's depth shows a wall at 2 m. A voxel is a pixel wide at 1 m.
class NarrowDifference : public testing::Test {
 protected:
  NarrowDifference() {
    camera_.width = 41;
    camera_.height = 31;
    camera_.fx = camera_.fy = 100;
    camera_.cx = 20;
    camera_.cy = 15;
    depth_m_ = capture::Image<float>(camera_.width, camera_.height, 1);
    std::fill(depth_m_.data.begin(), depth_m_.data.end(), 2.0f);
  }

  /// Number of pixels that moved, if the fused room is at 1 m in these columns.
  std::size_t found(int first, int last) const {
    const PixelRays rays(camera_);
    std::vector<GBufferPixel> seen(depth_m_.data.size());
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = 0; u < camera_.width; ++u) {
        GBufferPixel& pixel = seen[static_cast<std::size_t>(v * camera_.width + u)];
        pixel.known = true;
        pixel.w = rays.at(u, v);
        pixel.depth_m = (u >= first && u <= last ? 1.0f : 2.0f) / pixel.w.z();
        pixel.surface.normal = -Eigen::Vector3f::UnitZ();
      }
    }
    auto color = std::make_shared<capture::Frame>();
    color->radiance = capture::Image<float>(camera_.width, camera_.height, 3);
    capture::FrameSet frame;
    frame.color = color;
    CameraUpload picture{capture::ColorCamera{}};
    picture.take(frame);
    return moved_surfaces({}, {}, 0.01f, {rays, {camera_, Eigen::Isometry3f::Identity()}}, {rays, &depth_m_, 0.01f},
                          picture, seen)
        .size();
  }

  capture::CameraModel camera_;
  capture::Image<float> depth_m_;
};

TEST_F(NarrowDifference, IsARodThatLeftWhereDepthIsSmoothAllAround) {
  EXPECT_EQ(found(19, 20), static_cast<std::size_t>(2 * camera_.height));
}

TEST_F(NarrowDifference, IsADisplacedEdgeNextToAJumpOfDepth) {
  for (int v = 0; v < camera_.height; ++v) {
    for (int u = 0; u < 19; ++u) depth_m_.at(u, v) = 1;
  }
  EXPECT_EQ(found(0, 19), 0u);
}

}  // namespace
}  // namespace lumigraft::relight
