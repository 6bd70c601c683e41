// Chroma of objects is sampled as a camera's video format samples it.
#include "relight/compose/subsample_chroma.h"

#include <cmath>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr int kWidth = 12, kHeight = 6;
constexpr double kRounding = 1;  // pixel values, of colour that is rounded in three channels

double luma(const std::uint8_t* rgb) { return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; }
double blue(const std::uint8_t* rgb) { return (rgb[2] - luma(rgb)) / 1.772; }
double red(const std::uint8_t* rgb) { return (rgb[0] - luma(rgb)) / 1.402; }

/// Colours that differ from pixel to pixel and clip nowhere.
capture::Image<std::uint8_t> colorful() {
  capture::Image<std::uint8_t> picture(kWidth, kHeight, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i) picture.data[i] = static_cast<std::uint8_t>(90 + (i * 37) % 61);
  return picture;
}

/// An object in columns 3 to 6 of rows 1 to 3.
relight::ObjectLayer object() {
  return {3, 1, capture::Image<float>(4, 3, 3), capture::Image<float>(4, 3, 1, 0.5f),
          capture::Image<float>(4, 3, 1, 1)};
}

void expect_sampled(const capture::ChromaBlock& block) {
  const capture::Image<std::uint8_t> before = colorful();
  capture::Image<std::uint8_t> after = before;
  relight::subsample_chroma(block, object(), &after);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const int left = u / block.width * block.width, top = v / block.height * block.height;
      const bool covered = left + block.width > 3 && left < 7 && top + block.height > 1 && top < 4;
      double mean_blue = 0, mean_red = 0;
      for (int j = 0; j < block.height; ++j) {
        for (int i = 0; i < block.width; ++i) {
          mean_blue += blue(&before.at(left + i, top + j)) / (block.width * block.height);
          mean_red += red(&before.at(left + i, top + j)) / (block.width * block.height);
        }
      }
      const std::uint8_t *own = &before.at(u, v), *now = &after.at(u, v);
      EXPECT_NEAR(luma(now), luma(own), kRounding) << u << ", " << v;
      EXPECT_NEAR(blue(now), covered ? mean_blue : blue(own), kRounding) << u << ", " << v;
      EXPECT_NEAR(red(now), covered ? mean_red : red(own), kRounding) << u << ", " << v;
      if (!covered) {
        EXPECT_TRUE(std::equal(own, own + 3, now)) << u << ", " << v;
      }
    }
  }
}

TEST(SubsampleChroma, BlocksWithAnObjectHaveOneChroma) {
  expect_sampled({2, 1});
  expect_sampled({2, 2});
  expect_sampled({1, 1});
}

/// A box that is red on a grey floor: pixels at its outline get half of its colour.
TEST(SubsampleChroma, ARenderedObjectHasTheFormatOfTheCamera) {
  ClosedScene scene = box_on_floor();
  scene.exhibit.objects[0].material.base_color = Eigen::Vector3f(0.9f, 0.1f, 0.1f);
  capture::FrameSet frame = scene.frame();
  const auto odd_chroma = [&](const std::string& look, capture::PixelFormat format) {
    auto color = std::make_shared<capture::Frame>(*frame.color);
    color->original = std::make_shared<capture::RawFrame>(format, std::vector<std::uint8_t>());
    frame.color = color;
    relight::Plan plan = rays_plan(8, 4);
    plan.look = look;
    const relight::RelitPicture picture =
        relight::RayRenderer(scene.session()).relight(frame, scene.scene(), scene.exhibit, plan, true);
    double most = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u + 1 < scene.width; u += 2) {
        if (picture.maps->mask.at(u, v) + picture.maps->mask.at(u + 1, v) == 0) continue;
        most = std::max(most, std::abs(red(&picture.srgb.at(u, v)) - red(&picture.srgb.at(u + 1, v))));
      }
    }
    return most;
  };
  EXPECT_GT(odd_chroma("camera", capture::PixelFormat::rgb8), 20);
  EXPECT_LT(odd_chroma("camera", capture::PixelFormat::yuyv), 2 * kRounding);
  EXPECT_GT(odd_chroma("plain", capture::PixelFormat::yuyv), 20);
}

}  // namespace
}  // namespace lumigraft::test
