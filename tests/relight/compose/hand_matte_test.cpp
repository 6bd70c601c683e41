// A hand with fingers before an object, as a depth camera sees it: the coverage that is left of the object.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "capture/camera/srgb.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/rgb_image.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/compose/drawn_hand.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector2f;
using relight::Rgb;

constexpr int kWidth = 320, kHeight = 240, kFine = 8;
constexpr float kHand_m = 0.6f, kObject_m = 0.8f, kTable_m = 1;
const Rgb kSkin(0.42f, 0.26f, 0.19f), kLight(0.5f, 0.52f, 0.5f), kDark(0.2f, 0.22f, 0.24f);

/// Fraction of a pixel that the hand covers.
float coverage(const DrawnHand& hand, int u, int v) {
  const float away = hand.distance_px(Vector2f(static_cast<float>(u), static_cast<float>(v)));
  if (std::abs(away) > 1) return away < 0 ? 1 : 0;
  int inside = 0;
  for (int j = 0; j < kFine; ++j) {
    for (int i = 0; i < kFine; ++i) {
      const Vector2f p(static_cast<float>(u) + (static_cast<float>(i) + 0.5f) / kFine - 0.5f,
                       static_cast<float>(v) + (static_cast<float>(j) + 0.5f) / kFine - 0.5f);
      inside += hand.distance_px(p) < 0;
    }
  }
  return static_cast<float>(inside) / (kFine * kFine);
}

struct DepthFaults {
  Vector2f behind_px{0, 0};  ///< of the hand in depth from that in colour: colour is a frame later
  float outline_px = 0;      ///< 1σ of its outline, smooth over some pixels
  float noise_m = 0;         ///< 1σ
  float holes = 0;           ///< fraction of pixels without depth near the outline; a quarter of it elsewhere
};

/// Mean error of the object's coverage within 4 pixels of the hand's silhouette.
double coverage_error(const DepthFaults& faults) {
  ClosedScene scene;
  scene.width = kWidth;
  scene.height = kHeight;
  scene.focal_px = 280;
  const capture::Session session = scene.session();
  const relight::PixelRays rays(session.color.model);
  const DrawnHand hand({0, 0}), in_depth(faults.behind_px);
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform;
  // The error of the outline, on a grid of 4 pixels.
  std::array<std::array<float, kWidth / 4 + 2>, kHeight / 4 + 2> off;
  for (auto& row : off) {
    for (float& px : row) px = faults.outline_px * normal(random);
  }
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1;
  color->encoded = capture::Image<std::uint8_t>(kWidth, kHeight, 3);
  capture::Image<float> depth_m(kWidth, kHeight, 1), truth(kWidth, kHeight, 1);
  relight::ObjectLayer objects{0, 0, capture::Image<float>(kWidth, kHeight, 3),
                               capture::Image<float>(kWidth, kHeight, 1, 1.0f),
                               capture::Image<float>(kWidth, kHeight, 1)};
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      truth.data[i] = coverage(hand, u, v);
      const Vector2f p(static_cast<float>(u), static_cast<float>(v));
      const float shade = 1 - 0.25f * std::max(0.0f, 1 + hand.distance_px(p) / 16);  // rounded limbs are lit less
      const Rgb table =
          ((u / 24 + v / 24) % 2 == 0 ? kLight : kDark) * (1 + 0.1f * std::sin(0.7f * static_cast<float>(u)));
      const Rgb mixed = truth.data[i] * shade * kSkin + (1 - truth.data[i]) * table;
      for (int c = 0; c < 3; ++c) {
        const float value = mixed[c] * (1 + 0.01f * normal(random));
        color->encoded.at(u, v, c) = capture::srgb_table().code(value);
      }
      const float away =
          in_depth.distance_px(p) + off[static_cast<std::size_t>(v / 4)][static_cast<std::size_t>(u / 4)];
      const float seen_m = (away < 0 ? kHand_m : kTable_m) + faults.noise_m * normal(random);
      const bool hole = uniform(random) < (std::abs(away) < 2 ? faults.holes : 0.25f * faults.holes);
      depth_m.data[i] = hole ? 0 : seen_m;
      objects.distance_m.data[i] = kObject_m / rays.at(u, v).z();
    }
  }
  capture::FrameSet frame;
  frame.color = color;
  relight::CameraUpload picture(session.color);
  picture.take(frame);
  relight::hide_behind_foreground(relight::CurrentDepth(rays, &depth_m, 0.008f), picture, objects);
  double sum = 0;
  int count = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth - 8; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      if (std::abs(hand.distance_px({static_cast<float>(u), static_cast<float>(v)})) > 4) continue;
      sum += std::abs(1 - objects.coverage.data[i] - truth.data[i]);
      ++count;
    }
  }
  return sum / count;
}

TEST(HandMatte, ExactDepth) { EXPECT_LT(coverage_error({}), 0.04); }

TEST(HandMatte, NoisyDepthWithHolesAndADisplacedOutline) {
  EXPECT_LT(coverage_error({.outline_px = 1, .noise_m = 0.003f, .holes = 0.4f}), 0.08);
}

TEST(HandMatte, ColourIsAFrameLater) {
  for (const Vector2f& by_px : {Vector2f(4, 0), Vector2f(-3, 2), Vector2f(0, -5)}) {
    EXPECT_LT(coverage_error({.behind_px = by_px, .outline_px = 0.5f, .noise_m = 0.003f, .holes = 0.2f}), 0.08)
        << by_px.transpose();
  }
}

}  // namespace
}  // namespace lumigraft::test
