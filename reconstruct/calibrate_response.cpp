#include "reconstruct/calibrate_response.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "capture/error.h"
#include "capture/response.h"

namespace lumigraft {
namespace {

constexpr int kCodes = 256;
constexpr double kFirstNoise = 2.5, kLeastNoise = 0.3, kMostNoise = 3.3;  // 1σ in code values
// Readings count from so many σ from the ends of the scale, where noise is cut off and dark readings that noise lifts
// would pass for light.
constexpr double kFromEnds = 5.0;
constexpr double kLargestResidual = 0.05, kLeastRatio = 4;
constexpr int kFolds = 4;

using Codes = Eigen::VectorXd;   // a number for each code value
using Normal = Eigen::MatrixXd;  // for each pair of them

/// ln(linear) of sRGB, where the search begins.
Codes reference_ln() {
  Codes g(kCodes);
  for (int z = 0; z < kCodes; ++z) g[z] = std::log(srgb_to_linear(static_cast<float>(std::max(z, 1)) / 255.0f));
  return g;
}

/// Weight of a code value: the inverse variance of its ln(linear) under noise of the code, by the curve's slope. That
/// is taken for no less than a quarter and no more than four times sRGB's, so that a bad guess cannot run away.
Codes weights_of(const Codes& ln_linear, double noise) {
  static const Codes usual = reference_ln();
  Codes weights = Codes::Zero(kCodes);
  const int end = static_cast<int>(std::ceil(std::max(3.0, kFromEnds * noise)));
  for (int z = end; z < kCodes - end; ++z) {
    const double usual_slope = 0.5 * (usual[z + 1] - usual[z - 1]);
    const double slope = std::clamp(0.5 * (ln_linear[z + 1] - ln_linear[z - 1]), usual_slope / 4, usual_slope * 4);
    weights[z] = 1 / (slope * slope * noise * noise);
  }
  return weights;
}

/// Normal equations of Σ w (g(z) - ln e - E)² over all pixels and exposures, each pixel's E eliminated.
struct Equations {
  Normal a = Normal::Zero(kCodes, kCodes);
  Codes b = Codes::Zero(kCodes);
  double c = 0, freedom = 0;

  /// The sum at a curve g.
  double misfit(const Codes& g) const { return g.dot(a * g) - 2 * b.dot(g) + c; }
  Equations& operator+=(const Equations& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    freedom += other.freedom;
    return *this;
  }
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

  /// Of every kFolds-th pixel, from the one of this number on.
  Equations equations(const Codes& weights, std::size_t fold) const {
    Equations e;
    for_each_pixel(weights, fold, [&](const int* z, const double* w, const double* ln_e, int count, double sum) {
      double mean_ln_e = 0;
      for (int i = 0; i < count; ++i) mean_ln_e += w[i] * ln_e[i] / sum;
      for (int i = 0; i < count; ++i) {
        const double off = ln_e[i] - mean_ln_e;
        e.b[z[i]] += w[i] * off;
        e.c += w[i] * off * off;
        e.a(z[i], z[i]) += w[i];
        for (int k = 0; k < count; ++k) e.a(z[i], z[k]) -= w[i] * w[k] / sum;
      }
      e.freedom += count - 1;
    });
    return e;
  }

  /// Median distance between what a pixel's exposures say and their mean.
  double median_residual(const Codes& g, const Codes& weights) const {
    std::vector<float> shares;
    for (std::size_t fold = 0; fold < kFolds; ++fold)
      for_each_pixel(weights, fold, [&](const int* z, const double* w, const double* ln_e, int count, double sum) {
        double mean = 0;
        for (int i = 0; i < count; ++i) mean += w[i] * (g[z[i]] - ln_e[i]) / sum;
        for (int i = 0; i < count; ++i) shares.push_back(static_cast<float>(std::abs(g[z[i]] - ln_e[i] - mean)));
      });
    if (shares.empty()) return 0;
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    return *middle;
  }

 private:
  /// Calls with the code values of every pixel that was neither clipped nor black at two exposures or more.
  template <typename Function>
  void for_each_pixel(const Codes& weights, std::size_t fold, const Function& function) const {
    std::vector<int> z(pictures_.size());
    std::vector<double> w(pictures_.size()), ln_e(pictures_.size());
    for (std::size_t pixel = fold * step_; pixel < pixels_; pixel += kFolds * step_) {
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

/// What is known before: ln(linear) is smooth, the more so the brighter. Its fourth differences are small, which holds
/// for powers and for toes and shoulders alike. Where all exposures are powers of one ratio this alone tells the curve
/// from one with a ripple of that period in ln(linear), which fits the pictures as well.
const Normal& roughness() {
  static const Normal sum = [] {
    constexpr std::array<double, 5> kFourth = {1, -4, 6, -4, 1};
    Normal all = Normal::Zero(kCodes, kCodes);
    for (int z = 1; z + 4 < kCodes; ++z)
      for (int i = 0; i < 5; ++i)
        for (int k = 0; k < 5; ++k)
          all(z + i, z + k) += std::pow((z + 2) / 255.0, 4) * kFourth[static_cast<std::size_t>(i)] *
                               kFourth[static_cast<std::size_t>(k)];
    return all;
  }();
  return sum;
}

Eigen::LLT<Normal> solver_of(const Equations& e, double strength) {
  const double scale = e.a.diagonal().mean();
  Normal all = e.a + strength * scale * roughness();
  all(255, 255) += scale;  // the curve ends at ln 1 = 0
  all(0, 0) += scale;      // code 0 is no logarithm's
  return all.llt();
}

/// The smoothest curve whose misfit on pixels that were not used is within a standard error of the best (Breiman et
/// al. 1984, "Classification and Regression Trees", §3.4.3): the best itself bends after what noise does to dark codes.
double strength_by_cross_validation(const std::array<Equations, kFolds>& folds, const Equations& all) {
  constexpr double kWeakest = 1e5, kStrongest = 1e11, kStep = 3.1622776601683795;
  std::vector<std::pair<double, double>> tried;  // strength, misfit
  double least = std::numeric_limits<double>::infinity();
  for (double strength = kWeakest; strength < 1.1 * kStrongest; strength *= kStep) {
    double misfit = 0;
    for (const Equations& fold : folds) {
      Equations others = all;
      others.a -= fold.a;
      others.b -= fold.b;
      misfit += fold.misfit(solver_of(others, strength).solve(others.b));
    }
    tried.emplace_back(strength, misfit);
    least = std::min(least, misfit);
  }
  double smoothest = kWeakest;
  for (const auto& [strength, misfit] : tried)
    if (misfit <= least * (1 + std::sqrt(2 / std::max(all.freedom, 1.0)))) smoothest = strength;
  return smoothest;
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
  result.darkest = 0;
  result.brightest = 255;
  for (int c = 0; c < 3; ++c) {
    const Channel channel(pictures, c);
    Codes g = reference_ln();
    double noise = kFirstNoise;
    std::array<Equations, kFolds> folds;
    Equations measured;
    Codes weights;
    for (int round = 0; round < 4; ++round) {  // the weights follow the curve and the noise
      weights = weights_of(g, noise);
      measured = {};
      for (std::size_t fold = 0; fold < kFolds; ++fold) measured += folds[fold] = channel.equations(weights, fold);
      constexpr double kUsual = 1e8;
      g = solver_of(measured, kUsual).solve(measured.b);
      if (round < 3 && measured.freedom > 0)
        noise = std::clamp(noise * std::sqrt(measured.misfit(g) / measured.freedom), kLeastNoise, kMostNoise);
    }
    const auto solver = solver_of(measured, strength_by_cross_validation(folds, measured));
    g = solver.solve(measured.b);
    int low = kCodes - 1, high = 0;
    const double enough = 1e-6 * measured.a.diagonal().maxCoeff();
    for (int z = 0; z < kCodes; ++z)
      if (measured.a(z, z) > enough) {
        low = std::min(low, z);
        high = std::max(high, z);
      }
    result.darkest = std::max(result.darkest, low);
    result.brightest = std::min(result.brightest, high);
    result.residual = std::max(result.residual, channel.median_residual(g, weights));
    const double variance = measured.freedom > 0 ? measured.misfit(g) / measured.freedom : 1;
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
