// How pixels at the outline of what is in front of an object are divided.
#include "relight/compose/foreground_matte.h"

#include <algorithm>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/compose/rgb_image.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test::foreground_matte_tests {
namespace {

using relight::Rgb;

constexpr int kWidth = 320, kHeight = 64;
constexpr float kHand_m = 0.5f, kObject_m = 0.8f, kTable_m = 1;

/// A hand with a slanted outline before an object that covers the picture.
struct Outline {
  capture::Session session;
  relight::PixelRays rays;
  capture::FrameSet frame;
  capture::Image<float> depth_m{kWidth, kHeight, 1}, hand{kWidth, kHeight, 1};  ///< hand: part of the pixel
  relight::ObjectLayer objects;

  /// `off_px`: of the outline in depth from that in colour, by row.
  template <typename OffPx>
  Outline(const Rgb& of_hand, const Rgb& of_table, const Rgb& of_object, OffPx off_px)
      : session(session_of(kWidth, kHeight, 280)), rays(session.color.model) {
    auto color = std::make_shared<capture::Frame>();
    color->exposure = 1;
    color->encoded = capture::Image<std::uint8_t>(kWidth, kHeight, 3);
    objects.coverage = capture::Image<float>(kWidth, kHeight, 1, 1.0f);
    objects.radiance = capture::Image<float>(kWidth, kHeight, 3);
    objects.distance_m = capture::Image<float>(kWidth, kHeight, 1);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const auto i = static_cast<std::size_t>(v * kWidth + u);
        hand.at(u, v) = std::clamp(edge(v) - static_cast<float>(u) + 0.5f, 0.0f, 1.0f);
        const Rgb mixed = hand.at(u, v) * of_hand + (1 - hand.at(u, v)) * of_table;
        for (int c = 0; c < 3; ++c) {
          color->encoded.at(u, v, c) = static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(mixed[c])));
        }
        depth_m.at(u, v) = static_cast<float>(u) < edge(v) + off_px(v) ? kHand_m : kTable_m;
        relight::set_at(objects.radiance, i, of_object);
        objects.distance_m.data[i] = kObject_m / rays.at(u, v).z();
      }
    }
    frame.color = color;
  }

  static float edge(int v) { return 150 + 0.37f * static_cast<float>(v); }

  void hide() {
    relight::CameraUpload picture(session.color);
    picture.take(frame);
    relight::hide_behind_foreground(relight::CurrentDepth(rays, &depth_m, 0.008f), picture, objects);
  }
  /// Mean error of the hidden part within `reach_px` of the outline.
  double error(float reach_px) const {
    double sum = 0;
    int count = 0;
    for (int v = 8; v < kHeight - 8; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        if (std::abs(static_cast<float>(u) - edge(v)) > reach_px) continue;
        sum += std::abs(1 - objects.coverage.at(u, v) - hand.at(u, v));
        ++count;
      }
    }
    return sum / count;
  }
};

const Rgb kSkin(0.45f, 0.3f, 0.22f), kTable(0.2f, 0.22f, 0.24f), kGreen(0.1f, 0.4f, 0.15f);

TEST(ForegroundMatte, DividesPixelsAtAnExactOutline) {
  Outline outline(kSkin, kTable, kGreen, [](int) { return 0.0f; });
  outline.hide();
  EXPECT_LT(outline.error(4), 0.02);
  // The object replaces the table's part of the mixture: nothing of the table's colour is left at the outline.
  for (int v = 8; v < kHeight - 8; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const auto i = static_cast<std::size_t>(v * kWidth + u);
      const float hand = outline.hand.at(u, v), coverage = outline.objects.coverage.at(u, v);
      const Rgb camera = hand * kSkin + (1 - hand) * kTable, wanted = hand * kSkin + (1 - hand) * kGreen;
      const Rgb shown = (1 - coverage) * camera + relight::radiance_at(outline.objects.radiance, i);
      EXPECT_LT((shown - wanted).abs().maxCoeff(), 0.03f) << u << ", " << v;
    }
  }
}

TEST(ForegroundMatte, ColourCorrectsAnOutlineThatDepthMisplaces) {
  Outline outline(kSkin, kTable, kGreen, [](int v) { return v % 4 < 2 ? 1.0f : -1.0f; });
  Outline by_depth = outline;
  by_depth.frame.color = Outline(kSkin, kSkin, kGreen, [](int) { return 0.0f; }).frame.color;
  outline.hide();
  by_depth.hide();
  EXPECT_LT(outline.error(4), 0.08);
  EXPECT_LT(outline.error(4), 0.6 * by_depth.error(4)) << "colours that do not differ leave it to depth";
}

TEST(ForegroundMatte, OneColourLeavesItToDepth) {
  Outline outline(kSkin, kSkin, kGreen, [](int) { return 0.0f; });
  outline.hide();
  EXPECT_LT(outline.error(4), 0.08);
  for (int v = 0; v < kHeight; ++v) {
    EXPECT_LT(outline.objects.coverage.at(static_cast<int>(Outline::edge(v)) - 6, v), 1e-3f);
    EXPECT_EQ(outline.objects.coverage.at(static_cast<int>(Outline::edge(v)) + 6, v), 1.0f);
  }
}

TEST(ForegroundMatte, UnknownDepthBesideAHandIsDecidedByColour) {
  Outline outline(kSkin, kTable, kGreen, [](int) { return 0.0f; });
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (std::abs(static_cast<float>(u) - Outline::edge(v)) < 3) outline.depth_m.at(u, v) = 0;
    }
  }
  outline.hide();
  EXPECT_LT(outline.error(4), 0.08);
}

/// The shadow of a hand in the light of a depth camera's projector is wider than the reach of colours.
TEST(ForegroundMatte, InAWideBandWithoutDepthTheHandIsKnownByItsColour) {
  Outline outline(kSkin, kTable, kGreen, [](int) { return 0.0f; });
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const float beyond_px = static_cast<float>(u) - Outline::edge(v);
      if (beyond_px > -1 && beyond_px < 20) outline.depth_m.at(u, v) = 0;
    }
  }
  outline.hide();
  EXPECT_LT(outline.error(4), 0.1) << "pixels of both are of one";
  for (int v = 0; v < kHeight; ++v)
    for (int px = 2; px < 20; ++px)
      EXPECT_GT(outline.objects.coverage.at(static_cast<int>(Outline::edge(v)) + px, v), 0.95f) << px;
}

/// As next to an arm in front of a dark coat.
TEST(ForegroundMatte, AGapOfDepthInADarkPersonShowsNoObject) {
  const Rgb coat(0.018f, 0.002f, 0.003f);
  Outline outline(coat, coat, kGreen, [](int) { return 1000.0f; });
  for (int v = 0; v < kHeight; ++v) {
    for (int px = 0; px < 5; ++px) outline.depth_m.at(static_cast<int>(Outline::edge(v)) + px, v) = 0;
  }
  outline.hide();
  for (int v = 8; v < kHeight - 8; ++v) {
    for (int px = -8; px < 12; ++px)
      EXPECT_LT(outline.objects.coverage.at(static_cast<int>(Outline::edge(v)) + px, v), 0.05f) << px << ", " << v;
  }
}

TEST(ForegroundMatte, WithoutDepthNothingIsHidden) {
  Outline outline(kSkin, kTable, kGreen, [](int) { return 0.0f; });
  std::fill(outline.depth_m.data.begin(), outline.depth_m.data.end(), 0.0f);
  outline.hide();
  for (const float coverage : outline.objects.coverage.data) EXPECT_EQ(coverage, 1.0f);
}

}  // namespace
}  // namespace lumigraft::test::foreground_matte_tests
