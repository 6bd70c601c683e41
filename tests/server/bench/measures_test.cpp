#include "server/bench/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "capture/camera/srgb.h"
#include "capture/error.h"

namespace lumigraft::server {
namespace {

constexpr int kWidth = 40, kHeight = 10;

std::uint8_t code(float linear) {
  return static_cast<std::uint8_t>(std::lround(255.0f * capture::linear_to_srgb(linear)));
}
float linear_of(std::uint8_t code) { return capture::srgb_to_linear(static_cast<float>(code) / 255.0f); }

/// Four columns of ten pixels: unchanged, in shadow, half-covered rim in shadow, object. Values: real surfaces kReal,
/// in shadow kShadow, object kObject.
constexpr std::uint8_t kReal = 200, kShadow = 120, kObject = 60;

struct FourColumns {
  TruePictures truth;
  capture::Image<std::uint8_t> camera{kWidth, kHeight, 3, kReal};

  FourColumns() {
    truth.background = capture::Image<float>(kWidth, kHeight, 3, linear_of(kReal));
    truth.augmented = truth.background;
    truth.coverage = capture::Image<float>(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 10; x < kWidth; ++x) {
        const float coverage = x < 20 ? 0.0f : x < 30 ? 0.5f : 1.0f;
        truth.coverage.at(x, y) = coverage;
        for (int c = 0; c < 3; ++c) {
          truth.augmented.at(x, y, c) = coverage * linear_of(kObject) + (1 - coverage) * linear_of(kShadow);
        }
      }
    }
  }

  capture::Image<std::uint8_t> exact() const {
    capture::Image<std::uint8_t> picture(kWidth, kHeight, 3);
    for (std::size_t i = 0; i < picture.data.size(); ++i) {
      picture.data[i] = code(truth.augmented.data[i]);
    }
    return picture;
  }
};

TEST(BenchMeasures, ACameraPictureLeftAsItIsScoresOne) {
  const FourColumns scene;
  const Measures m = measure_picture(scene.camera, scene.camera, scene.truth);
  EXPECT_NEAR(m.relight_error, 1.0, 1e-4);
  const double shadow = (kReal - kShadow) / 255.0;
  EXPECT_NEAR(m.psnr_relit_db, -20 * std::log10(shadow), 1e-3);
}

TEST(BenchMeasures, TheExactPictureScoresNothingButRounding) {
  const FourColumns scene;
  const Measures m = measure_picture(scene.exact(), scene.camera, scene.truth);
  EXPECT_LT(m.relight_error, 1e-5);
  EXPECT_LT(m.object_error, 0.005);
  EXPECT_GT(m.psnr_db, 55);
  EXPECT_LT(m.flip, 0.01);
}

// Camera noise is kept where no object covers the pixel, and halved under a half-covered rim.
TEST(BenchMeasures, TheCamerasOwnErrorIsPartOfTheTruth) {
  FourColumns scene;
  scene.camera = capture::Image<std::uint8_t>(kWidth, kHeight, 3, kReal + 10);
  const float noise = linear_of(kReal + 10) - linear_of(kReal);
  capture::Image<std::uint8_t> with_noise(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        with_noise.at(x, y, c) = code(scene.truth.augmented.at(x, y, c) + (1 - scene.truth.coverage.at(x, y)) * noise);
      }
    }
  }
  EXPECT_GT(measure_picture(with_noise, scene.camera, scene.truth).psnr_db, 55);
  EXPECT_LT(measure_picture(scene.exact(), scene.camera, scene.truth).psnr_db, 35);
}

// One wrong column at a time: which measures change, and by how much.
TEST(BenchMeasures, EveryMeasureUsesItsOwnPixels) {
  const FourColumns scene;
  const auto with_column = [&](int column, std::uint8_t value) {
    capture::Image<std::uint8_t> picture = scene.exact();
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 10 * column; x < 10 * column + 10; ++x) {
        for (int c = 0; c < 3; ++c) {
          picture.at(x, y, c) = value;
        }
      }
    }
    return measure_picture(picture, scene.camera, scene.truth);
  };
  const Measures exact = measure_picture(scene.exact(), scene.camera, scene.truth);

  const Measures untouched = with_column(0, kReal + 20);
  EXPECT_NEAR(untouched.psnr_db, -10 * std::log10(std::pow(20 / 255.0, 2) / 4), 0.01);
  EXPECT_EQ(untouched.psnr_affected_db, exact.psnr_affected_db);
  EXPECT_EQ(untouched.relight_error, exact.relight_error);
  EXPECT_GT(untouched.flip, exact.flip);

  const Measures shadow = with_column(1, kShadow + 20);
  EXPECT_NEAR(shadow.relight_error,
              (linear_of(kShadow + 20) - linear_of(kShadow)) / (linear_of(kReal) - linear_of(kShadow)), 1e-4);
  EXPECT_EQ(shadow.object_error, exact.object_error);
  EXPECT_NEAR(shadow.psnr_relit_db, -20 * std::log10(20 / 255.0), 0.01);

  const Measures object = with_column(3, kObject + 20);
  const float rim = 0.5f * (linear_of(kObject) + linear_of(kShadow));
  EXPECT_NEAR(object.object_error, (linear_of(kObject + 20) - linear_of(kObject)) / std::hypot(linear_of(kObject), rim),
              2e-3);
  EXPECT_EQ(object.relight_error, exact.relight_error);
  EXPECT_NEAR(object.psnr_object_db, -10 * std::log10(std::pow(20 / 255.0, 2) / 2), 0.01);
}

TEST(BenchMeasures, WhatHasNoPixelsIsNotANumber) {
  FourColumns scene;
  scene.truth.augmented = scene.truth.background;
  scene.truth.coverage = capture::Image<float>(kWidth, kHeight, 1);
  const Measures m = measure_picture(scene.camera, scene.camera, scene.truth);
  EXPECT_TRUE(std::isnan(m.relight_error) && std::isnan(m.object_error) && std::isnan(m.psnr_affected_db));
  EXPECT_FALSE(std::isnan(m.psnr_db));
}

TEST(BenchMeasures, SizesMustAgree) {
  const FourColumns scene;
  EXPECT_THROW(measure_picture(capture::Image<std::uint8_t>(kWidth, kHeight + 1, 3), scene.camera, scene.truth),
               capture::InputError);
  EXPECT_THROW(read_true_pictures("/nowhere", 1), capture::InputError);
}

}  // namespace
}  // namespace lumigraft::server
