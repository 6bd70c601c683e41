#pragma once
// A camera with known noise: shot and read noise in linear light, mixed between neighbouring pixels and channels as
// demosaicing and denoising do, rounded to 8-bit sRGB.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>

#include "capture/camera/srgb.h"
#include "capture/image.h"

namespace lumigraft::test {

using Codes = capture::Image<std::uint8_t>;

struct NoisyCamera {
  double shot = 4e-4, read = 2e-6;  ///< variance of linear values: shot * value + read
  double smoothing_px = 0.7;        ///< σ of a Gaussian over the noise; 0: white
  float mixed = 0.4f;               ///< part of the noise that all channels share
  std::mt19937 random{7};

  /// `light`: linear, of three channels.
  std::shared_ptr<const Codes> picture(const cv::Mat3f& light) {
    cv::Mat4f white(light.size());  // three channels, and what they share
    std::normal_distribution<float> normal;
    for (cv::Vec4f& value : white) value = {normal(random), normal(random), normal(random), normal(random)};
    if (smoothing_px > 0) {
      cv::GaussianBlur(white, white, {0, 0}, smoothing_px, smoothing_px, cv::BORDER_REFLECT);
      white = white * (2 * std::sqrt(M_PI) * smoothing_px);  // unit variance again, to 1 % from 0.7 px on
    }
    auto codes = std::make_shared<Codes>(light.cols, light.rows, 3);
    for (int v = 0; v < light.rows; ++v) {
      for (int u = 0; u < light.cols; ++u) {
        const cv::Vec4f& own = white(v, u);
        for (int c = 0; c < 3; ++c) {
          const float noise = std::sqrt(1 - mixed) * own[c] + std::sqrt(mixed) * own[3];
          const double value = light(v, u)[c], sigma = std::sqrt(shot * value + read);
          codes->at(u, v, c) = capture::srgb_table().code(static_cast<float>(value + sigma * noise));
        }
      }
    }
    return codes;
  }
};

/// Four by three fields of different levels and tints, from dark to bright.
inline cv::Mat3f fields(int width, int height) {
  cv::Mat3f light(height, width);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int field = 4 * (3 * v / height) + 4 * u / width;
      const float level = 0.01f * std::pow(1.42f, static_cast<float>(field));
      light(v, u) = {level, 0.8f * level, 1.2f * level};
    }
  }
  return light;
}

/// Standard deviation and spectrum of the difference of two pictures over √2.
struct Residual {
  std::array<double, 3> sigma{};
  std::array<std::array<double, 4>, 3> bands{};  ///< variance by frequency: up to 1/8, 1/4, 3/8 and 1/2 per pixel

  /// Of pairs of pictures, in a square of 64 pixels.
  void add(const Codes& a, const Codes& b, int left, int top) {
    constexpr int kEdge = 64;
    for (int c = 0; c < 3; ++c) {
      cv::Mat1f noise(kEdge, kEdge), wave[2];
      for (int v = 0; v < kEdge; ++v) {
        for (int u = 0; u < kEdge; ++u) {
          noise(v, u) = static_cast<float>((a.at(left + u, top + v, c) - b.at(left + u, top + v, c)) / M_SQRT2);
        }
      }
      cv::Mat spectrum;
      cv::dft(noise, spectrum, cv::DFT_COMPLEX_OUTPUT | cv::DFT_SCALE);
      cv::split(spectrum, wave);
      for (int v = 0; v < kEdge; ++v) {
        for (int u = 0; u < kEdge; ++u) {
          const double power = std::norm(std::complex<double>(wave[0](v, u), wave[1](v, u)));
          const int fu = std::min(u, kEdge - u), fv = std::min(v, kEdge - v);
          bands[static_cast<std::size_t>(c)][static_cast<std::size_t>(std::min(std::max(fu, fv) / (kEdge / 8), 3))] +=
              power;
          sum[static_cast<std::size_t>(c)] += power;
        }
      }
    }
    ++count;
    for (std::size_t c = 0; c < 3; ++c) sigma[c] = std::sqrt(sum[c] / count);
  }

  std::array<double, 3> sum{};
  int count = 0;
};

}  // namespace lumigraft::test
