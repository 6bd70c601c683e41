#include "reconstruct/calibrate_response.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "capture/error.h"
#include "capture/response.h"

namespace lumigraft {
namespace {

constexpr int kCodes = 256;
constexpr int kDarkest = 3, kBrightest = 252;  // beyond them noise is cut off by the ends of the scale
constexpr double kCodeNoise = 0.7;             // 1σ in code values: rounding, and a sensor's own
constexpr double kLargestResidual = 0.05, kLeastRatio = 4;

using Codes = Eigen::VectorXd;   // a number for each code value
using Normal = Eigen::MatrixXd;  // for each pair of them

/// What is solved for is how ln(linear) departs from sRGB's: that is smooth where the response itself is not.
double reference(int code) { return std::log(srgb_to_linear(static_cast<float>(std::max(code, 1)) / 255.0f)); }

/// Weight of a code value: the inverse variance of its ln(linear) under noise of the code, by the curve's slope.
Codes weights_of(const Codes& ln_linear) {
  Codes weights = Codes::Zero(kCodes);
  for (int z = kDarkest; z <= kBrightest; ++z) {
    const double slope = std::max(1e-4, 0.5 * (ln_linear[z + 1] - ln_linear[z - 1]));
    weights[z] = 1 / (slope * slope * kCodeNoise * kCodeNoise);
  }
  return weights;
}

/// Normal equations of Σ w (g(z) - ln e - E)² over all pixels and exposures, each pixel's E eliminated.
struct Equations {
  Normal a = Normal::Zero(kCodes, kCodes);
  Codes b = Codes::Zero(kCodes);
};

class Channel {
 public:
  Channel(const std::vector<ExposedPicture>& pictures, int channel) : pictures_(pictures), channel_(channel) {
    for (const ExposedPicture& picture : pictures) ln_exposure_.push_back(std::log(picture.exposure));
    const Image<std::uint8_t>& first = pictures.front().encoded;
    // Some hundred thousand pixels say all there is; a lattice that follows no row or column.
    const std::size_t pixels = static_cast<std::size_t>(first.width) * static_cast<std::size_t>(first.height);
    step_ = std::max<std::size_t>(1, pixels / 200000);
    pixels_ = pixels;
  }

  Equations equations(const Codes& weights) const {
    Equations e;
    for_each_pixel(weights, [&](const int* z, const double* w, const double* ln_e, int count, double sum) {
      double mean_ln_e = 0;
      for (int i = 0; i < count; ++i) mean_ln_e += w[i] * ln_e[i] / sum;
      for (int i = 0; i < count; ++i) {
        e.b[z[i]] += w[i] * (ln_e[i] - mean_ln_e);
        e.a(z[i], z[i]) += w[i];
        for (int k = 0; k < count; ++k) e.a(z[i], z[k]) -= w[i] * w[k] / sum;
      }
    });
    return e;
  }

  /// Distances between what a pixel's exposures say and their mean, and Σ w r² with its degrees of freedom.
  struct Residuals {
    std::vector<float> shares;
    double chi_square = 0;
    double freedom = 0;
  };
  Residuals residuals(const Codes& g, const Codes& weights) const {
    Residuals r;
    for_each_pixel(weights, [&](const int* z, const double* w, const double* ln_e, int count, double sum) {
      double mean = 0;
      for (int i = 0; i < count; ++i) mean += w[i] * (g[z[i]] - ln_e[i]) / sum;
      for (int i = 0; i < count; ++i) {
        const double error = g[z[i]] - ln_e[i] - mean;
        r.shares.push_back(static_cast<float>(std::abs(error)));
        r.chi_square += w[i] * error * error;
      }
      r.freedom += count - 1;
    });
    return r;
  }

 private:
  /// Calls with the code values of every pixel that was neither clipped nor black at two exposures or more.
  template <typename Function>
  void for_each_pixel(const Codes& weights, const Function& function) const {
    std::vector<int> z(pictures_.size());
    std::vector<double> w(pictures_.size()), ln_e(pictures_.size());
    for (std::size_t pixel = 0; pixel < pixels_; pixel += step_) {
      int count = 0;
      double sum = 0;
      for (std::size_t i = 0; i < pictures_.size(); ++i) {
        const int code = pictures_[i].encoded.data[3 * pixel + static_cast<std::size_t>(channel_)];
        if (!(weights[code] > 0)) continue;
        z[static_cast<std::size_t>(count)] = code;
        w[static_cast<std::size_t>(count)] = weights[code];
        ln_e[static_cast<std::size_t>(count++)] = ln_exposure_[i];
        sum += weights[code];
      }
      if (count >= 2) function(z.data(), w.data(), ln_e.data(), count, sum);
    }
  }

  const std::vector<ExposedPicture>& pictures_;
  int channel_;
  std::vector<double> ln_exposure_;
  std::size_t pixels_ = 0, step_ = 1;
};

/// Adds what is known before: few bends in how the curve departs from sRGB's, the fewer the brighter, and one free
/// scale. Where all exposures are powers of one ratio this alone tells the curve from one with a ripple of that period
/// in ln(linear), which fits the pictures as well.
void add_smoothness(Equations& e, const Codes& reference_ln) {
  const double strength = 3e3 * e.a.diagonal().mean();
  for (int z = 1; z + 1 < kCodes; ++z) {
    const double at = strength * std::pow(z / 255.0, 2);
    constexpr double kBend[3] = {1, -2, 1};
    double bend = 0;
    for (int i = 0; i < 3; ++i) bend += kBend[i] * reference_ln[z - 1 + i];
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) e.a(z - 1 + i, z - 1 + k) += at * kBend[i] * kBend[k];
      e.b[z - 1 + i] += at * kBend[i] * bend;
    }
  }
  e.a(255, 255) += e.a.diagonal().mean();  // the curve ends at ln 1 = 0
}

}  // namespace

ResponseCalibration calibrate_response(const std::vector<ExposedPicture>& pictures) {
  ResponseCalibration result;
  double least = 0, most = 0;
  for (const ExposedPicture& picture : pictures) {
    const Image<std::uint8_t>& first = pictures.front().encoded;
    if (picture.encoded.width != first.width || picture.encoded.height != first.height)
      throw InputError("exposure sweep: found pictures of two sizes, allowed: one");
    least = least > 0 ? std::min(least, picture.exposure) : picture.exposure;
    most = std::max(most, picture.exposure);
  }
  char line[200];
  if (pictures.size() < 3 || !(most >= kLeastRatio * least)) {
    std::snprintf(
        line, sizeof line,
        "exposures: found %zu pictures, the longest exposure %.1f times the shortest, allowed: at least 3 and "
        "%.0f times",
        pictures.size(), least > 0 ? most / least : 0.0, kLeastRatio);
    result.refusal = line;
    return result;
  }
  Codes reference_ln(kCodes);
  for (int z = 0; z < kCodes; ++z) reference_ln[z] = reference(z);
  result.darkest = 0;
  result.brightest = 255;
  for (int c = 0; c < 3; ++c) {
    const Channel channel(pictures, c);
    Codes g = reference_ln;
    Eigen::LDLT<Normal> solver;
    Equations measured;
    Codes weights;
    for (int round = 0; round < 3; ++round) {  // the weights follow the curve
      weights = weights_of(g);
      measured = channel.equations(weights);
      Equations all = measured;
      add_smoothness(all, reference_ln);
      solver.compute(all.a);
      g = solver.solve(all.b);
    }
    int low = kBrightest, high = kDarkest;
    const double enough = 1e-3 * measured.a.diagonal().maxCoeff();
    for (int z = kDarkest; z <= kBrightest; ++z)
      if (measured.a(z, z) > enough * 1e-3) {
        low = std::min(low, z);
        high = std::max(high, z);
      }
    result.darkest = std::max(result.darkest, low);
    result.brightest = std::min(result.brightest, high);
    Channel::Residuals residuals = channel.residuals(g, weights);
    const double variance = residuals.freedom > 0 ? residuals.chi_square / residuals.freedom : 1;
    if (!residuals.shares.empty()) {
      const auto middle = residuals.shares.begin() + static_cast<std::ptrdiff_t>(residuals.shares.size() / 2);
      std::nth_element(residuals.shares.begin(), middle, residuals.shares.end());
      result.residual = std::max(result.residual, static_cast<double>(*middle));
    }
    const Normal covariance = solver.solve(Normal::Identity(kCodes, kCodes));
    auto& linear = result.linear[static_cast<std::size_t>(c)];
    for (int z = 0; z < kCodes; ++z) {
      linear[static_cast<std::size_t>(z)] = std::exp(g[z] - g[255]);
      const double square = covariance(z, z) + covariance(255, 255) - 2 * covariance(z, 255);
      result.sigma[static_cast<std::size_t>(c)][static_cast<std::size_t>(z)] =
          std::sqrt(std::max(0.0, variance * square));
    }
    linear[0] = std::max(0.0, 2 * linear[1] - linear[2]);
    for (std::size_t z = 1; z < kCodes; ++z) linear[z] = std::clamp(linear[z], linear[z - 1], 1.0);
  }
  if (result.darkest > 24 || result.brightest < 235) {
    std::snprintf(
        line, sizeof line,
        "coverage: found code values %d to %d alone at two exposures or more, allowed: at most 24 to at least "
        "235; show dark and bright things, and more exposures",
        result.darkest, result.brightest);
    result.refusal = line;
  } else if (!(result.residual <= kLargestResidual)) {
    std::snprintf(
        line, sizeof line,
        "residual: found exposures that differ by %.0f %% in the median from what they are said to be, allowed: "
        "at most %.0f %%; did something move, or is a control automatic?",
        100 * result.residual, 100 * kLargestResidual);
    result.refusal = line;
  }
  return result;
}

void write_response_file(std::ostream& out, const ResponseCalibration& calibration) {
  out << "# Written by lumigraft calibrate: linear values of R, G and B by code value\n";
  for (std::size_t z = 0; z < kCodes; ++z) {
    char line[80];
    std::snprintf(line, sizeof line, "%.7f %.7f %.7f\n", calibration.linear[0][z], calibration.linear[1][z],
                  calibration.linear[2][z]);
    out << line;
  }
}

}  // namespace lumigraft
