// A hand's shadow on the room: no albedo, and light that the room does not reflect any more.
#include <algorithm>
#include <cmath>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// A box on a floor, which the camera sees finer than it was fused.
class ShadowOnFloor : public testing::Test {
 protected:
  ShadowOnFloor() : scene_(box_on_floor()) {
    scene_.width *= 3;
    scene_.height *= 3;
    scene_.focal_px *= 3;
    room_ = scene_.scene();
  }

  /// The floor darkened to this fraction in the columns from `left` on.
  capture::FrameSet shadowed(float fraction, int left) const {
    capture::FrameSet frame = scene_.frame();
    auto color = std::make_shared<capture::Frame>(*frame.color);
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = left; u < scene_.width; ++u) {
        for (int c = 0; c < 3; ++c) color->radiance.at(u, v, c) *= fraction;
      }
    }
    frame.color = color;
    return frame;
  }
  relight::RelitPicture relit(const capture::FrameSet& frame, const relight::Plan& plan = rays_plan()) {
    relight::RayRenderer renderer(scene_.session());
    return renderer.relight(frame, room_, scene_.exhibit, plan, true);
  }
  /// Farther from a shadow's edge than `edge_px`.
  void expect_own_albedo(const relight::RelitPicture& picture, int left, int edge_px) const {
    int pixels = 0;
    for (int v = scene_.height / 2; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u) {
        if (picture.maps->mask.at(u, v) > 0 || picture.maps->albedo.at(u, v, 0) == 0) continue;
        if (std::abs(u - left) <= edge_px) continue;
        EXPECT_NEAR(picture.maps->albedo.at(u, v, 0), scene_.albedo, 0.15f * scene_.albedo) << u << ", " << v;
        ++pixels;
      }
    }
    EXPECT_GT(pixels, 1000);
  }

  ClosedScene scene_;
  reconstruct::Scene room_;
};

TEST_F(ShadowOnFloor, IsNoAlbedo) {
  const int left = scene_.width / 2;
  expect_own_albedo(relit(shadowed(0.3f, left)), left, 2);
}

TEST_F(ShadowOnFloor, IsNoAlbedoWhereBlocksOfPixelsShareLight) {
  const int left = scene_.width / 2 + 1;  // within a block
  expect_own_albedo(relit(shadowed(0.3f, left), rays_plan(8)), left, 4);
}

TEST_F(ShadowOnFloor, TextureIsAlbedo) {
  capture::FrameSet frame = shadowed(0.3f, scene_.width / 2);
  auto color = std::make_shared<capture::Frame>(*frame.color);
  const auto texture = [](int u, int v) { return (u + v) % 2 == 0 ? 1.25f : 0.75f; };
  for (int v = 0; v < scene_.height; ++v) {
    for (int u = 0; u < scene_.width; ++u) {
      for (int c = 0; c < 3; ++c) color->radiance.at(u, v, c) *= texture(u, v);
    }
  }
  frame.color = color;
  const relight::RelitPicture picture = relit(frame);
  double error = 0;
  int pixels = 0;
  for (int v = scene_.height / 2; v < scene_.height; ++v) {
    for (int u = 0; u < scene_.width; ++u) {
      if (picture.maps->mask.at(u, v) > 0 || picture.maps->albedo.at(u, v, 0) == 0) continue;
      error += std::abs(picture.maps->albedo.at(u, v, 0) / scene_.albedo - texture(u, v));
      ++pixels;
    }
  }
  EXPECT_LT(error / pixels, 0.15);
}

/// Sides of the box are lit by the floor and the sky alone.
TEST_F(ShadowOnFloor, ReflectsLessOntoObjects) {
  const relight::RelitPicture lit = relit(scene_.frame()), dark = relit(shadowed(0.2f, 0));
  double before = 0, after = 0;
  int pixels = 0;
  for (int v = 0; v < scene_.height; ++v) {
    for (int u = 0; u < scene_.width; ++u) {
      if (lit.maps->mask.at(u, v) < 0.99f || lit.maps->normals.at(u, v, 1) > -0.99f) continue;
      before += static_cast<double>(picture_radiance(lit, u, v));
      after += static_cast<double>(picture_radiance(dark, u, v));
      ++pixels;
    }
  }
  ASSERT_GT(pixels, 200) << "the side towards the camera";
  EXPECT_LT(after, 0.75 * before);
  EXPECT_GT(after, 0.2 * before);
}

}  // namespace
}  // namespace lumigraft::test
