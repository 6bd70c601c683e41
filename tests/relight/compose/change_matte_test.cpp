// The change of light at the outline of a hand.
#include "relight/compose/change_matte.h"

#include <algorithm>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/compose/rgb_image.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test::change_matte_tests {
namespace {

using relight::Rgb;

constexpr int kWidth = 160, kHeight = 40;
constexpr float kHand_m = 0.5f, kTable_m = 1, kShadow = 0.6f;  // kShadow: the part of its light that the table loses
const Rgb kSkin(0.45f, 0.3f, 0.22f), kTable(0.2f, 0.25f, 0.3f);

/// A lit hand over a table in an object's shadow.
struct HandOverShadow {
  capture::Session session;
  relight::PixelRays rays;
  capture::Image<float> depth_m{kWidth, kHeight, 1}, hand{kWidth, kHeight, 1}, change{kWidth, kHeight, 3};
  capture::Image<std::uint8_t> front{kWidth, kHeight, 1};
  relight::CameraUpload picture;
  relight::ObjectLayer objects;

  HandOverShadow() : session(session_of(kWidth, kHeight, 140)), rays(session.color.model), picture(session.color) {
    auto color = std::make_shared<capture::Frame>();
    color->exposure = 1;
    color->encoded = capture::Image<std::uint8_t>(kWidth, kHeight, 3);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const auto i = static_cast<std::size_t>(v * kWidth + u);
        hand.data[i] = std::clamp(edge(v) - static_cast<float>(u) + 0.5f, 0.0f, 1.0f);
        const Rgb mixed = hand.data[i] * kSkin + (1 - hand.data[i]) * kTable;
        for (int c = 0; c < 3; ++c) color->encoded.at(u, v, c) = capture::srgb_table().code(mixed[c]);
        front.data[i] = static_cast<float>(u) < edge(v) ? 255 : 0;
        depth_m.data[i] = front.data[i] != 0 ? kHand_m : kTable_m;
        // As renderers find it: of the surface that depth shows, in proportion to the pixel's radiance.
        relight::set_at(change, i, front.data[i] != 0 ? Rgb::Zero().eval() : (-kShadow * mixed).eval());
      }
    }
    capture::FrameSet frame;
    frame.color = color;
    picture.take(frame);
  }

  void divide() {
    relight::divide_change(relight::CurrentDepth(rays, &depth_m, 0.008f), picture, front, objects, change);
  }
  static float edge(int v) { return 70.2f + 0.37f * static_cast<float>(v); }
};

TEST(ChangeMatte, PixelsOfTwoSurfacesGetTheChangeOfBoth) {
  HandOverShadow scene;
  const capture::Image<float> before = scene.change;
  scene.divide();
  double error = 0, undivided = 0;
  for (int v = 8; v < kHeight - 8; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      const Rgb exact = -kShadow * (1 - scene.hand.data[i]) * kTable;
      if (std::abs(static_cast<float>(u) - HandOverShadow::edge(v)) > 6) {
        EXPECT_EQ(scene.change.data[3 * i], before.data[3 * i]) << u << ", " << v;
        continue;
      }
      error += static_cast<double>((relight::radiance_at(scene.change, i) - exact).square().sum());
      undivided += static_cast<double>((relight::radiance_at(before, i) - exact).square().sum());
    }
  }
  EXPECT_LT(std::sqrt(error), 0.35 * std::sqrt(undivided));
}

TEST(ChangeMatte, BehindAnObjectTheHandsPartIsLeft) {
  HandOverShadow scene;
  scene.objects = {0, 0, capture::Image<float>(kWidth, kHeight, 3), capture::Image<float>(kWidth, kHeight, 1, 1.0f),
                   capture::Image<float>(kWidth, kHeight, 1, 0.8f)};
  scene.divide();
  int checked = 0;
  for (int v = 8; v < kHeight - 8; ++v) {
    const auto i = static_cast<std::size_t>(v * kWidth) + static_cast<std::size_t>(HandOverShadow::edge(v)) + 1;
    if (scene.hand.data[i] < 0.2f) continue;
    ++checked;
    EXPECT_NEAR(scene.change.data[3 * i], 0, 0.01f) << v;  // the composer multiplies it by the hand's part
  }
  EXPECT_GE(checked, 5);  // of 24 rows: in 3 of 10 the hand covers a fifth or more of the pixel
}

TEST(ChangeMatte, EqualChangesStay) {
  HandOverShadow scene;
  for (std::size_t i = 0; i < scene.change.data.size(); ++i) scene.change.data[i] = -0.05f;
  scene.divide();
  for (const float value : scene.change.data) EXPECT_EQ(value, -0.05f);
}

}  // namespace
}  // namespace lumigraft::test::change_matte_tests
