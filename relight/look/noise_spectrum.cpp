#include "relight/look/noise_spectrum.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>

#include "relight/look/parameters.h"

namespace lumigraft::relight {
namespace {

using Complex = std::complex<float>;

/// A frequency's number, seen from frequency 0.
int from_zero(int k, int edge) { return k <= edge / 2 ? k : k - edge; }

const std::array<float, NoiseSpectrum::kEdge>& hann() {
  static const auto window = [] {
    std::array<float, NoiseSpectrum::kEdge> w{};
    for (std::size_t i = 0; i < w.size(); ++i) {
      w[i] = 0.5f - 0.5f * std::cos(2 * std::numbers::pi_v<float> * (static_cast<float>(i) + 0.5f) /
                                    static_cast<float>(w.size()));
    }
    return w;
  }();
  return window;
}

}  // namespace

void NoiseSpectrum::add(const std::array<Patch, 3>& patch) {
  std::array<cv::Mat, 3> transformed;
  for (std::size_t c = 0; c < 3; ++c) {
    float squares = 0;
    for (const float value : patch[c]) squares += value * value;
    const float scale = squares > 0 ? std::sqrt(static_cast<float>(kBins) / squares) : 0;
    cv::Mat1f windowed(kEdge, kEdge);
    for (int v = 0; v < kEdge; ++v) {
      for (int u = 0; u < kEdge; ++u) {
        windowed(v, u) = scale * hann()[static_cast<std::size_t>(u)] * hann()[static_cast<std::size_t>(v)] *
                         patch[c][static_cast<std::size_t>(v * kEdge + u)];
      }
    }
    cv::dft(windowed, transformed[c], cv::DFT_COMPLEX_OUTPUT);
  }
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      Eigen::Vector3cf value;
      for (int c = 0; c < 3; ++c) {
        const auto& f = transformed[static_cast<std::size_t>(c)].at<cv::Vec2f>(v, u);
        value[c] = Complex(f[0], f[1]);
      }
      sum_[static_cast<std::size_t>(v * kEdge + u)] += value * value.adjoint();
    }
  }
  weight_ += 1;
}

std::vector<NoiseSpectrum::Density> NoiseSpectrum::complete() const {
  constexpr int kMissing = 1;  // in units of 1/kEdge per pixel: the frequencies that the window mixes with 0
  constexpr int kNear2 = 4, kFar2 = 13;
  // Near 0 the density is taken as a Gaussian, exp(a - b f²), as of noise that a filter has smoothed.
  Density nearest = Density::Zero();
  Eigen::Array3f sum_log = Eigen::Array3f::Zero(), sum_product = sum_log;
  float count = 0, sum_f2 = 0, sum_f4 = 0, nearest_count = 0;
  const auto square = [](int v, int u) {
    const int y = from_zero(v, kEdge), x = from_zero(u, kEdge);
    return x * x + y * y;
  };
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      const int f2 = square(v, u);
      if (f2 < kNear2 || f2 > kFar2) continue;
      const Density& density = sum_[static_cast<std::size_t>(v * kEdge + u)];
      const Eigen::Array3f log = density.diagonal().real().array().max(1e-20f).log();
      count += 1;
      sum_f2 += static_cast<float>(f2);
      sum_f4 += static_cast<float>(f2 * f2);
      sum_log += log;
      sum_product += static_cast<float>(f2) * log;
      if (f2 != kNear2) continue;
      nearest += density;
      nearest_count += 1;
    }
  }
  nearest /= nearest_count;  // phases cancel: what remains is real, as it must be at frequency 0
  const Eigen::Array3f slope =
      ((count * sum_product - sum_f2 * sum_log) / (count * sum_f4 - sum_f2 * sum_f2)).min(0.0f).max(-kLook.max_slope);
  std::vector<Density> all = sum_;
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      const int f2 = square(v, u);
      if (f2 > 2 * kMissing * kMissing) continue;
      const Eigen::Array3f root = (0.5f * slope * static_cast<float>(f2 - kNear2)).exp();
      const Density scale = root.matrix().asDiagonal().toDenseMatrix().cast<Complex>();
      all[static_cast<std::size_t>(v * kEdge + u)] = scale * nearest * scale;
    }
  }
  return all;
}

Eigen::Array3f NoiseSpectrum::missing_variance() const {
  Eigen::Array3f before = Eigen::Array3f::Zero(), after = before;
  const std::vector<Density> all = complete();
  for (std::size_t i = 0; i < kBins; ++i) {
    before += sum_[i].diagonal().real().array();
    after += all[i].diagonal().real().array();
  }
  return (before > 0).select(after / before.max(1e-20f), Eigen::Array3f::Ones());
}

std::shared_ptr<const NoiseTile> NoiseSpectrum::tile() const {
  constexpr int kTile = NoiseTile::kEdge, kStep = kTile / kEdge;
  const std::vector<Density> all = complete();
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  std::array<cv::Mat, 3> waves;
  for (cv::Mat& wave : waves) {
    cv::Mat1f white(kTile, kTile);
    for (float& value : white) value = normal(random);
    cv::dft(white, wave, cv::DFT_COMPLEX_OUTPUT);
    // Of equal amplitude: the tile has the spectrum itself, not a sample of it.
    for (auto& f : cv::Mat2f(wave)) f /= std::max(std::hypot(f[0], f[1]), 1e-6f);
  }
  const auto bin = [&](int v, int u) -> const Density& {
    return all[static_cast<std::size_t>((v % kEdge) * kEdge + u % kEdge)];
  };
  for (int v = 0; v < kTile; ++v) {
    for (int u = 0; u < kTile; ++u) {
      const float y = static_cast<float>(v % kStep) / kStep, x = static_cast<float>(u % kStep) / kStep;
      Density density = (1 - y) * ((1 - x) * bin(v / kStep, u / kStep) + x * bin(v / kStep, u / kStep + 1)) +
                        y * ((1 - x) * bin(v / kStep + 1, u / kStep) + x * bin(v / kStep + 1, u / kStep + 1));
      density.diagonal().array() += 1e-6f * density.trace();  // positive definite in spite of rounding
      const Density root = Eigen::LLT<Density>(density).matrixL();
      std::array<Complex, 3> white;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto& f = waves[c].at<cv::Vec2f>(v, u);
        white[c] = {f[0], f[1]};
      }
      for (std::size_t c = 0; c < 3; ++c) {
        Complex sum = 0;
        for (std::size_t k = 0; k <= c; ++k) {
          sum += root(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(k)) * white[k];
        }
        waves[c].at<cv::Vec2f>(v, u) = {sum.real(), sum.imag()};
      }
    }
  }
  auto tile = std::make_shared<NoiseTile>();
  for (std::size_t c = 0; c < 3; ++c) {
    cv::Mat1f noise;
    cv::dft(waves[c], noise, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
    cv::Scalar mean, deviation;
    cv::meanStdDev(noise, mean, deviation);
    if (!(deviation[0] > 0)) continue;
    for (int i = 0; i < kTile * kTile; ++i) {
      tile->values[std::size_t{3} * static_cast<std::size_t>(i) + c] =
          (noise(i / kTile, i % kTile) - static_cast<float>(mean[0])) / static_cast<float>(deviation[0]);
    }
  }
  return tile;
}

}  // namespace lumigraft::relight
