// The change of light at every pixel of the camera, from a view with fewer pixels.
#include "relight/views/upsample_change.h"

#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/compose/reduced_view.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr int kScale = 2;

/// A wall at 1 m left of a column, one at 2 m from there on, seen by a camera whose picture has texture.
class Upsampling : public testing::Test {
 protected:
  Upsampling() {
    ClosedScene scene;
    scene.width = 33;  // a square at the border is narrower
    scene.height = 18;
    camera_ = scene.session().color;
    auto color = std::make_shared<capture::Frame>();
    color->exposure = 1;
    color->encoded = capture::Image<std::uint8_t>(scene.width, scene.height, 3);
    for (std::size_t i = 0; i < color->encoded.data.size(); ++i)
      color->encoded.data[i] = static_cast<std::uint8_t>(60 + 37 * (i / 3) % 100);
    auto depth = std::make_shared<capture::DepthFrame>();
    depth->depth_m = capture::Image<float>(scene.width, scene.height, 1, 1);
    for (int v = 0; v < scene.height; ++v) {
      for (int u = column_; u < scene.width; ++u) depth->depth_m.at(u, v) = 2;
    }
    frame_.color = color;
    frame_.depth = depth;
  }

  /// `ratio(pixel)`: of the view at half size, the change over the radiance.
  template <typename Ratio>
  relight::FullChange upsampled(Ratio ratio) {
    relight::CameraUpload picture(camera_);
    picture.take(frame_);
    relight::ReducedView view(camera_, kScale);
    view.take(frame_);
    const capture::CameraModel& model = view.model();
    relight::RoomInView room;
    room.scale = kScale;
    room.camera = model;
    room.radiance = view.picture().radiance();
    room.change = capture::Image<float>(model.width, model.height, 3);
    room.tiles = {model.width, model.height, true};
    for (int y = 0; y < model.height; ++y) {
      for (int x = 0; x < model.width; ++x) {
        relight::ViewSurface& p = room.surfaces.emplace_back();
        const Eigen::Vector3f at_1m = model.unproject({x, y})->cast<float>();
        p.known = true;
        p.position_m = view.depth_m()->at(x, y) / at_1m.z() * at_1m;
        p.normal = -Eigen::Vector3f::UnitZ();
        p.depth_m = p.position_m.norm();
        const auto i = static_cast<std::size_t>(y * model.width + x);
        relight::set_at(room.change, i, ratio(p) * relight::radiance_at(room.radiance, i));
      }
    }
    const relight::PixelRays rays(camera_.model);
    relight::FullChange full;
    relight::upsample(room, {rays, {camera_.model, Eigen::Isometry3f::Identity()}},
                      {rays, relight::depth_of(frame_, camera_.model), 0.008f}, objects_, picture, full);
    return full;
  }
  relight::Rgb radiance_at(int u, int v) const {
    const std::uint8_t* code = &frame_.color->encoded.at(u, v);
    const auto linear = [&](std::uint8_t c) { return capture::srgb_to_linear(static_cast<float>(c) / 255); };
    return {linear(code[0]), linear(code[1]), linear(code[2])};
  }
  /// Objects at this distance along the rays of these and all lower rows.
  void cover_rows_from(int top, float distance_m) {
    objects_.top = top;
    objects_.coverage = capture::Image<float>(camera_.model.width, camera_.model.height - top, 1, 1);
    objects_.distance_m = capture::Image<float>(camera_.model.width, camera_.model.height - top, 1, distance_m);
  }
  template <typename Check>
  void for_pixels(Check check) const {
    for (int v = 0; v < camera_.model.height; ++v) {
      for (int u = 0; u < camera_.model.width; ++u) check(u, v, frame_.color->encoded.index(u, v) / 3);
    }
  }

  const int column_ = 17;
  capture::ColorCamera camera_;
  capture::FrameSet frame_;
  relight::ObjectLayer objects_;
};

TEST_F(Upsampling, AnEvenShadowDarkensEveryPixelByItsPart) {
  const relight::FullChange full = upsampled([](const relight::ViewSurface&) { return -0.25f; });
  for_pixels([&](int u, int v, std::size_t i) {
    const relight::Rgb expected = -0.25f * radiance_at(u, v);
    EXPECT_LT((relight::radiance_at(full.change, i) - expected).abs().maxCoeff(), 1e-4f) << u << ", " << v;
    EXPECT_LT((relight::radiance_at(full.radiance, i) - radiance_at(u, v)).abs().maxCoeff(), 1e-4f);
  });
}

TEST_F(Upsampling, AShadowThatEndsAtAnEdgeOfDepthEndsAtItsPixel) {
  const relight::FullChange full =
      upsampled([](const relight::ViewSurface& p) { return p.position_m.z() < 1.5f ? -0.5f : 0.0f; });
  for_pixels([&](int u, int v, std::size_t i) {
    const relight::Rgb expected = (u < column_ ? -0.5f : 0.0f) * radiance_at(u, v);
    EXPECT_LT((relight::radiance_at(full.change, i) - expected).abs().maxCoeff(), 1e-3f) << u << ", " << v;
  });
}

// An object covers the lower rows, and the walls behind it become black.
TEST_F(Upsampling, TheShadowUnderAnObjectEndsAtItsEdge) {
  constexpr int top = 12;
  cover_rows_from(top, 0.5f);
  const relight::FullChange full = upsampled([&](const relight::ViewSurface& p) {
    return camera_.model.project(p.position_m.cast<double>())->y() > top - 0.4 ? -1.0f : 0.0f;
  });
  for_pixels([&](int u, int v, std::size_t i) {
    if (v >= top) return;
    EXPECT_LT(relight::radiance_at(full.change, i).abs().maxCoeff(), 1e-3f) << u << ", " << v;
  });
}

// A hand before an object is in its light.
TEST_F(Upsampling, WhatIsBeforeAnObjectKeepsItsChange) {
  cover_rows_from(6, 5);
  const relight::FullChange full = upsampled([](const relight::ViewSurface&) { return -0.25f; });
  for_pixels([&](int u, int v, std::size_t i) {
    const relight::Rgb expected = -0.25f * radiance_at(u, v);
    EXPECT_LT((relight::radiance_at(full.change, i) - expected).abs().maxCoeff(), 1e-4f) << u << ", " << v;
  });
}

TEST_F(Upsampling, APenumbraIsLinearAndNotDisplaced) {
  const auto ratio_at = [](double x) { return static_cast<float>(-0.01 * x); };
  const relight::FullChange full = upsampled(
      [&](const relight::ViewSurface& p) { return ratio_at(camera_.model.project(p.position_m.cast<double>())->x()); });
  for_pixels([&](int u, int v, std::size_t i) {
    if (u < kScale || v < kScale || u >= camera_.model.width - kScale || std::abs(u - column_) <= kScale) return;
    const relight::Rgb expected = ratio_at(u) * radiance_at(u, v);
    EXPECT_LT((relight::radiance_at(full.change, i) - expected).abs().maxCoeff(), 1e-4f) << u << ", " << v;
  });
}

TEST_F(Upsampling, WhatClipsInOnePixelClipsInItsSquare) {
  auto color = std::make_shared<capture::Frame>(*frame_.color);
  color->encoded.at(5, 4, 1) = 255;
  frame_.color = color;
  relight::ReducedView view(camera_, kScale);
  view.take(frame_);
  const auto square = static_cast<std::size_t>(2 * view.model().width + 2);
  EXPECT_TRUE(view.picture().clipped(square, 1));
  EXPECT_FALSE(view.picture().clipped(square, 0));
  EXPECT_FALSE(view.picture().clipped(square + 1));
}

TEST(ReducedView, ItsPixelsLookAtTheMiddleOfTheirSquares) {
  ClosedScene scene;
  scene.width = 40;
  scene.height = 24;
  const capture::ColorCamera camera = scene.session().color;
  for (const int scale : {2, 4}) {
    const relight::ReducedView view(camera, scale);
    const double middle = 0.5 * (scale - 1);
    for (const Eigen::Vector2d& square : {Eigen::Vector2d(0, 0), Eigen::Vector2d(3, 5)}) {
      const Eigen::Vector3d w = *view.model().unproject(square);
      EXPECT_LT((*camera.model.project(w) - (scale * square + Eigen::Vector2d(middle, middle))).norm(), 1e-9) << scale;
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
