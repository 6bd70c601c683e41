// Noise of known cameras: measured, and given to objects and to shadows.
#include <gtest/gtest.h>

#include <cmath>

#include "relight/compose/add_noise.h"
#include "relight/look/noise_estimator.h"
#include "tests/relight/look/noisy_camera.h"

namespace lumigraft::test {
namespace {

using relight::NoiseEstimator;
using relight::NoiseModel;

constexpr int kWidth = 320, kHeight = 240, kFrames = 40;

/// Of a camera 1 m above the plane of the tag, which looks down.
relight::Viewpoint above(double x_m = 0) {
  relight::Viewpoint from;
  from.camera.width = kWidth;
  from.camera.height = kHeight;
  from.camera.fx = from.camera.fy = 250;
  from.camera.cx = 159.5;
  from.camera.cy = 119.5;
  from.T_tag_camera.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  from.T_tag_camera.translation() = Eigen::Vector3d(x_m, 0, 1);
  return from;
}

std::shared_ptr<const NoiseModel> measured(NoisyCamera& camera, const cv::Mat3f& light, int frames = kFrames) {
  NoiseEstimator estimator;
  for (int i = 0; i < frames; ++i) estimator.take(camera.picture(light), above());
  return estimator.model();
}

/// Code values are those of `light`; sRGB's slope leads from linear σ to pixel values.
double sigma_codes(const NoisyCamera& camera, int code) {
  const std::array<float, 256>& linear = capture::srgb_table().linear;
  const auto i = static_cast<std::size_t>(code);
  return std::sqrt(camera.shot * linear[i] + camera.read) * 2 / (linear[i + 1] - linear[i - 1]);
}

TEST(Noise, IsMeasuredAtEveryLevel) {
  for (const double smoothing_px : {0.0, 0.7, 1.2}) {
    NoisyCamera camera{.smoothing_px = smoothing_px};
    const auto model = measured(camera, fields(kWidth, kHeight));
    ASSERT_TRUE(model);
    for (int code = 24; code < 200; code += 8) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double sigma = std::sqrt(model->variance[c][static_cast<std::size_t>(code)]);
        EXPECT_NEAR(sigma / sigma_codes(camera, code), 1, 0.1) << code << ", " << c << ", " << smoothing_px << " px";
      }
    }
    EXPECT_EQ(model->variance[0][255], 0) << "clipped values have no noise";
  }
}

TEST(Noise, OfAnObjectIsThatOfTheCamera) {
  NoisyCamera camera;
  const auto model = measured(camera, fields(kWidth, kHeight));
  ASSERT_TRUE(model);
  // The object is as bright as the surface that it hides was.
  for (const float level : {0.02f, 0.1f, 0.4f}) {
    const cv::Mat3f even(64, 64, cv::Vec3f{level, 0.8f * level, 1.2f * level});
    Codes object(64, 64, 3);
    for (std::size_t i = 0; i < object.data.size(); ++i)
      object.data[i] = capture::srgb_table().code(even(0)[static_cast<int>(i % 3)]);
    const relight::ObjectLayer layer{0, 0, {}, capture::Image<float>(64, 64, 1, 1.0f), {}};
    Residual real, virtual_one;
    for (std::uint64_t i = 0; i < 60; ++i) {
      const auto a = camera.picture(even), b = camera.picture(even);
      real.add(*a, *b, 0, 0);
      Codes x = object, y = object;
      relight::add_noise(*model, *a, layer, 2 * i, &x);
      relight::add_noise(*model, *b, layer, 2 * i + 1, &y);
      virtual_one.add(x, y, 0, 0);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(virtual_one.sigma[c] / real.sigma[c], 1, 0.1) << level << ", channel " << c;
      for (std::size_t band = 0; band < 4; ++band) {
        EXPECT_NEAR(virtual_one.bands[c][band] / real.bands[c][band], 1,
                    0.1 + 0.02 * real.bands[c][0] / real.bands[c][band])
            << level << ", channel " << c << ", band " << band;
      }
    }
  }
}

TEST(Noise, OfAShadowIsThatOfItsLevel) {
  NoisyCamera camera;
  const auto model = measured(camera, fields(kWidth, kHeight));
  ASSERT_TRUE(model);
  constexpr float kLit = 0.4f, kFactor = 0.3f;
  const cv::Mat3f lit(64, 64, cv::Vec3f::all(kLit)), dark = kFactor * lit;
  Residual real, virtual_one;
  for (std::uint64_t i = 0; i < 60; ++i) {
    real.add(*camera.picture(dark), *camera.picture(dark), 0, 0);
    std::array<Codes, 2> shadow;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto picture = camera.picture(lit);
      shadow[k] = *picture;
      for (std::uint8_t& code : shadow[k].data)
        code = capture::srgb_table().code(kFactor * capture::srgb_table().linear[code]);
      relight::add_noise(*model, *picture, {}, 2 * i + k, &shadow[k]);
    }
    virtual_one.add(shadow[0], shadow[1], 0, 0);
  }
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(virtual_one.sigma[c] / real.sigma[c], 1, 0.1) << c;
}

TEST(Noise, TextureThatMovesIsNotNoise) {
  NoisyCamera camera;
  NoiseEstimator estimator;
  const cv::Mat3f even = fields(kWidth, kHeight);
  for (int i = 0; i < 60; ++i) {
    cv::Mat3f light = even.clone();
    // The lower half has stripes that move by 3 px per frame, and a bar crosses the picture.
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        if (v >= kHeight / 2) light(v, u) *= 1 + 0.5f * std::sin(0.7f * static_cast<float>(u + 3 * i));
        if (std::abs(u - 5 * i) < 20) light(v, u) = {0.3f, 0.2f, 0.1f};
      }
    }
    estimator.take(camera.picture(light), above());
  }
  ASSERT_TRUE(estimator.model());
  for (const int code : {40, 80, 120}) {
    EXPECT_NEAR(std::sqrt(estimator.model()->variance[1][static_cast<std::size_t>(code)]) / sigma_codes(camera, code),
                1, 0.15)
        << code;
  }
}

// Most of the picture is grain of a few pixels. The camera is static at first and then moves.
TEST(Noise, TextureBeforeAMovingCameraIsNotNoise) {
  constexpr int kTravel = 200, kStill = 20;
  cv::Mat3f floor(kHeight, kWidth + kTravel);
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, 1);
  for (cv::Vec3f& value : floor) value = cv::Vec3f::all(normal(random));
  cv::GaussianBlur(floor, floor, {0, 0}, 1.5);
  for (int v = 0; v < kHeight; ++v) {
    const float level = v < kHeight / 2 ? 0.08f : 0.3f;
    for (int u = 0; u < floor.cols; ++u)
      floor(v, u) = cv::Vec3f::all(level * (v % (kHeight / 2) < 40 ? 1 : 1 + floor(v, u)[0]));
  }
  NoisyCamera camera;
  NoiseEstimator estimator;
  for (int i = 0; i < 60; ++i) {
    const double moved_px = 2.3 * std::max(i - kStill, 0);
    const cv::Matx23d shift(1, 0, -moved_px, 0, 1, 0);
    cv::Mat3f light;
    cv::warpAffine(floor, light, shift, {kWidth, kHeight}, cv::INTER_CUBIC);
    estimator.take(camera.picture(light), above(moved_px / 250));
    if (i < kStill || i % 5 != 0) continue;
    ASSERT_TRUE(estimator.model());
    for (const int code : {80, 148}) {
      const float variance = estimator.model()->variance[1][static_cast<std::size_t>(code)];
      EXPECT_NEAR(std::sqrt(variance) / sigma_codes(camera, code), 1, 0.15) << code << ", frame " << i;
    }
  }
}

TEST(Noise, FollowsACameraThatRaisesItsGain) {
  NoisyCamera camera;
  NoiseEstimator estimator;
  const cv::Mat3f light = fields(kWidth, kHeight);
  for (int i = 0; i < kFrames; ++i) estimator.take(camera.picture(light), above());
  camera.shot *= 4;
  camera.read *= 16;
  for (int i = 0; i < 20; ++i) estimator.take(camera.picture(light), above());
  for (const int code : {40, 80, 120, 160}) {
    EXPECT_NEAR(std::sqrt(estimator.model()->variance[1][static_cast<std::size_t>(code)]) / sigma_codes(camera, code),
                1, 0.15)
        << code;
  }
}

TEST(Noise, NoneIsKnownWithoutFlatPatches) {
  NoisyCamera silent{.shot = 0, .read = 0};
  NoisyCamera noisy;
  EXPECT_FALSE(measured(noisy, cv::Mat3f(kHeight, kWidth, cv::Vec3f::all(2)), 10)) << "all pixels are clipped";
  EXPECT_FALSE(measured(noisy, fields(8, 8), 10)) << "smaller than a patch";
  if (const auto model = measured(silent, fields(kWidth, kHeight))) {
    for (const float variance : model->variance[1]) EXPECT_LT(variance, 0.01f) << "frames are equal";
  }
  cv::Mat3f checks(kHeight, kWidth);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) checks(v, u) = cv::Vec3f::all((u / 3 + v / 3) % 2 ? 0.4f : 0.1f);
  }
  EXPECT_FALSE(measured(noisy, checks, 10)) << "texture everywhere";
}

TEST(Noise, IsTheSameForTheSameFrame) {
  NoisyCamera camera;
  const auto model = measured(camera, fields(kWidth, kHeight));
  ASSERT_TRUE(model);
  const auto picture = camera.picture(fields(64, 64));
  Codes dark = *picture;
  for (std::uint8_t& code : dark.data) code /= 2;
  Codes once = dark, again = dark, next = dark;
  relight::add_noise(*model, *picture, {}, 5, &once);
  relight::add_noise(*model, *picture, {}, 5, &again);
  relight::add_noise(*model, *picture, {}, 6, &next);
  EXPECT_EQ(once.data, again.data);
  EXPECT_NE(once.data, next.data);
}

}  // namespace
}  // namespace lumigraft::test
