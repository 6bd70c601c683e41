#include "capture/camera/radiance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "capture/camera/srgb.h"
#include "capture/camera/vignetting.h"

namespace lumigraft::capture {
namespace {

/// Frame of an 8-bit sRGB camera that sees a row of grey radiances.
std::shared_ptr<Frame> expose(const std::vector<double>& radiance, double exposure) {
  auto picture = std::make_shared<Frame>();
  picture->exposure = exposure;
  picture->encoded = Image<std::uint8_t>(static_cast<int>(radiance.size()), 1, 3);
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const float linear = static_cast<float>(exposure * radiance[i]);
      picture->encoded.at(static_cast<int>(i), 0, c) =
          static_cast<std::uint8_t>(std::lround(255.0f * linear_to_srgb(linear)));
    }
  }
  return picture;
}

std::vector<double> sweep(double low, double high, int count) {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    out.push_back(low * std::pow(high / low, i / (count - 1.0)));
  }
  return out;
}

TEST(Radiance, OneFrameIsResponseOverExposure) {
  Frame picture;
  picture.exposure = 4.0;
  picture.encoded = Image<std::uint8_t>(2, 1, 3);
  picture.encoded.data = {0, 128, 249, 10, 250, 20};
  const RadianceImage out = to_radiance(picture, Response::srgb());
  EXPECT_FLOAT_EQ(out.radiance.data[1], srgb_to_linear(128 / 255.0f) / 4.0f);
  EXPECT_FLOAT_EQ(out.radiance.data[4], srgb_to_linear(250 / 255.0f) / 4.0f);
  EXPECT_EQ(out.clipped.data, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(out.clipped_fraction, 0.5);
}

TEST(Radiance, FramesOfRadiancePassThrough) {
  Frame picture;
  picture.exposure = 7.0;
  picture.radiance = Image<float>(2, 1, 3);
  picture.radiance.data = {1e6f, 0.5f, -0.25f, 1.0f, std::numeric_limits<float>::infinity(), std::nanf("")};
  const RadianceImage out = to_radiance(picture, Response::srgb());
  EXPECT_EQ(out.radiance.data, (std::vector<float>{1e6f, 0.5f, 0.0f, 1.0f, 0.0f, 0.0f}));
  EXPECT_EQ(out.clipped.data, (std::vector<std::uint8_t>{0, 1})) << "NaN becomes 0, a lower bound";
}

TEST(Radiance, ABracketOfFourKeepsItsRoundingError) {
  const std::vector<double> truth = sweep(1e-3, 500.0, 2000);
  const double longest = 6.25;
  std::vector<std::shared_ptr<const Frame>> bracket;
  for (const double stop : {1.0, 1.0 / 16, 1.0 / 256, 1.0 / 4096}) {
    bracket.push_back(expose(truth, longest * stop));
  }
  const RadianceImage merged = merge_bracket(bracket, Response::srgb());
  EXPECT_EQ(merged.clipped_fraction, 0.0);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    // Largest rounding error, just after a longer exposure has clipped: half a pixel value at 1/16 of full scale, 2.5
    // %.
    const double allowed = 0.025 * truth[i] + 0.5 / 255.0 / 12.92 / longest;
    EXPECT_NEAR(merged.radiance.data[3 * i], truth[i], allowed);
  }
}

TEST(Radiance, TheOrderOfABracketDoesNotMatter) {
  const std::vector<double> truth = sweep(1e-3, 500.0, 200);
  std::vector<std::shared_ptr<const Frame>> bracket = {expose(truth, 6.25), expose(truth, 0.39), expose(truth, 0.024)};
  const RadianceImage one = merge_bracket(bracket, Response::srgb());
  std::reverse(bracket.begin(), bracket.end());
  EXPECT_EQ(merge_bracket(bracket, Response::srgb()).radiance.data, one.radiance.data);
}

TEST(Radiance, PixelsClippedInTheShortestExposureAreLowerBounds) {
  const std::vector<double> truth = {1.0, 10.0, 100.0, 1e5};
  const RadianceImage merged = merge_bracket({expose(truth, 0.5), expose(truth, 0.05)}, Response::srgb());
  EXPECT_EQ(merged.clipped.data, (std::vector<std::uint8_t>{0, 0, 1, 1}));
  EXPECT_EQ(merged.clipped_fraction, 0.5);
  EXPECT_NEAR(merged.radiance.data[3], 10.0, 0.1);
  EXPECT_NEAR(merged.radiance.data[6], 20.0, 1e-4) << "full scale divided by the shortest exposure";
  EXPECT_NEAR(merged.radiance.data[9], 20.0, 1e-4);
}

TEST(Radiance, OneFrameIsABracketOfOne) {
  const auto picture = expose(sweep(0.01, 2.0, 50), 1.0);
  EXPECT_EQ(merge_bracket({picture}, Response::srgb()).radiance.data,
            to_radiance(*picture, Response::srgb()).radiance.data);
  EXPECT_TRUE(merge_bracket({}, Response::srgb()).radiance.empty());
}

TEST(Radiance, VignettingIsCorrected) {
  CameraModel camera;
  camera.kind = CameraModel::Kind::equidistant;
  camera.width = camera.height = 65;
  camera.fx = camera.fy = 20;
  camera.cx = camera.cy = 32;
  camera.fov_rad = 3.0;
  const Vignetting vignetting{{-0.3, 0.05, -0.02}};
  EXPECT_EQ(vignetting.transmission(0), 1.0);
  EXPECT_NEAR(vignetting.transmission(1.2), std::exp(-0.3 * 1.44 + 0.05 * 2.0736 - 0.02 * 2.985984), 1e-12);
  RadianceImage picture;
  picture.radiance = Image<float>(65, 65, 3);
  for (int v = 0; v < 65; ++v)
    for (int u = 0; u < 65; ++u)
      for (int c = 0; c < 3; ++c)
        picture.radiance.at(u, v, c) =
            static_cast<float>((c + 1) * vignetting.transmission(std::hypot(u - 32, v - 32) / 20));
  undo_vignetting(picture, vignetting_gain(vignetting, camera));
  EXPECT_NEAR(picture.radiance.at(32, 32, 0), 1, 1e-6);
  EXPECT_NEAR(picture.radiance.at(54, 44, 1), 2, 1e-5);
  EXPECT_NEAR(picture.radiance.at(8, 40, 2), 3, 1e-5);
  const float outside = picture.radiance.at(0, 0, 0);
  EXPECT_EQ(outside, static_cast<float>(vignetting.transmission(std::hypot(32, 32) / 20)))
      << "outside the field of view";
  EXPECT_TRUE(vignetting_gain({}, camera).empty());
  const RadianceImage before = picture;
  undo_vignetting(picture, {});
  EXPECT_EQ(picture.radiance.data, before.radiance.data);
}

}  // namespace
}  // namespace lumigraft::capture
