#include "reconstruct/calibrate/response.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "capture/camera/response.h"
#include "capture/error.h"

namespace lumigraft::reconstruct {
namespace {

constexpr int kCodes = 256;
constexpr double kFirstNoise = 2.5, kLeastNoise = 0.3, kMostNoise = 8;  // 1σ in code values
// Readings count from so many σ from the ends of the scale, where noise is cut off: by what they read, since that picks
// noise too, and by where the fit of the pixel's light puts them.
constexpr double kFromEnds = 5.0, kFitFromEnds = 2.5;
constexpr double kLargestResidual = 0.05, kLeastRatio = 4;
constexpr int kFolds = 4, kFirstRounds = 3, kRounds = 8;

using Codes = Eigen::VectorXd;   // a number for each code value
using Normal = Eigen::MatrixXd;  // for each pair of them

/// ln(linear) of sRGB, where the search begins.
Codes reference_ln() {
  Codes g(kCodes);
  for (int z = 0; z < kCodes; ++z)
    g[z] = std::log(capture::srgb_to_linear(static_cast<float>(std::max(z, 1)) / 255.0f));
  return g;
}

/// 1σ of a reading in code values, by where it lies on the scale: light's own noise grows with its root, which a curve
/// that is steep in the dark makes ten times what it makes of it near white. Found in bins, between which it is drawn
/// out.
class Noise {
 public:
  Noise() { sigma_.fill(kFirstNoise); }
  double at(double code) const {
    const double x = std::clamp(code / kBin - 0.5, 0.0, kBins - 1.0);
    const auto low = std::min(static_cast<std::size_t>(x), kBins - 2);
    return sigma_[low] + (x - static_cast<double>(low)) * (sigma_[low + 1] - sigma_[low]);
  }
  /// Whether a reading is so far from both ends of the scale.
  bool is_within(double code, double sigmas, double least) const {
    const double from_ends = std::max(least, sigmas * at(code));
    return code >= from_ends && code <= kCodes - 1 - from_ends;
  }

  /// Squared distances of readings from the fits of their pixels, and what share of their own noise is left in them.
  struct Sums {
    std::array<double, 16> square{}, left{};
    void add(double code, double distance, double share_left) {
      const auto bin = static_cast<std::size_t>(std::clamp(code / kBin, 0.0, kBins - 1.0));
      square[bin] += distance * distance;
      left[bin] += share_left;
    }
  };
  /// Bins that too few readings fell into are as the nearest.
  void learn(const Sums& sums) {
    constexpr double kEnough = 30;
    std::array<double, kBins> found{};
    for (std::size_t i = 0; i < kBins; ++i)
      if (sums.left[i] > kEnough)
        found[i] = std::clamp(std::sqrt(sums.square[i] / sums.left[i]), kLeastNoise, kMostNoise);
    if (*std::max_element(found.begin(), found.end()) == 0) return;
    for (std::size_t i = 0; i < kBins; ++i)
      for (std::size_t off = 0; off < kBins; ++off) {
        if (i >= off && found[i - off] > 0) {
          sigma_[i] = found[i - off];
          break;
        }
        if (i + off < kBins && found[i + off] > 0) {
          sigma_[i] = found[i + off];
          break;
        }
      }
  }

 private:
  static constexpr std::size_t kBins = 16;
  static constexpr double kBin = kCodes / 16.0;
  std::array<double, kBins> sigma_{};
};

/// Normal equations of Σ w (h g - c - E)² over all pixels and exposures, each pixel's E eliminated.
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

/// A curve as it is used: from light to codes.
class Forward {
 public:
  /// Its slope is taken for no less than a quarter and no more than four times sRGB's, so that a bad guess cannot run
  /// away.
  explicit Forward(const Codes& ln_linear) : ln_(ln_linear), slope_(kCodes) {
    static const Codes usual = reference_ln();
    ln_[0] = ln_[1] - 1;  // code 0 is no logarithm's
    for (int z = 1; z < kCodes; ++z) ln_[z] = std::max(ln_[z], ln_[z - 1] + 1e-6);
    for (int z = 1; z + 1 < kCodes; ++z) {
      const double usual_slope = 0.5 * (usual[z + 1] - usual[z - 1]);
      slope_[z] = std::clamp(0.5 * (ln_[z + 1] - ln_[z - 1]), usual_slope / 4, usual_slope * 4);
    }
    slope_[0] = slope_[1];
    slope_[kCodes - 1] = slope_[kCodes - 2];
  }
  /// The code of some light, a fraction; outside of the scale one of its ends.
  double code(double ln_light) const {
    const auto above = std::upper_bound(ln_.begin(), ln_.end(), ln_light);
    if (above == ln_.begin()) return 0;
    if (above == ln_.end()) return kCodes - 1;
    const auto z = above - ln_.begin();
    return static_cast<double>(z - 1) + (ln_light - ln_[z - 1]) / (ln_[z] - ln_[z - 1]);
  }
  double ln(double code) const { return ln_[static_cast<Eigen::Index>(std::lround(code))]; }
  /// Of ln(light) by code.
  double slope(double code) const { return slope_[static_cast<Eigen::Index>(std::lround(code))]; }

 private:
  Codes ln_, slope_;
};

/// What is believed: readings as they are, or the light that fits a pixel's.
enum class Trust { readings, fits };

/// Pixels are compared in code values, where noise has no bias: in ln(linear) it pulls dark readings down. So each
/// pixel's light is fitted to its readings through the newest curve, and the equations are those of Gauss and Newton
/// for Σ (z - f(E + ln e))², f the curve's inverse. Readings count by where that fit puts them, of which their
/// distances from it are independent; picking them by what they read picks noise with them.
class Channel {
 public:
  Channel(const std::vector<ExposedPicture>& pictures, int channel) : pictures_(pictures), channel_(channel) {
    for (const ExposedPicture& picture : pictures) ln_exposure_.push_back(std::log(picture.exposure));
    const capture::Image<std::uint8_t>& first = pictures.front().encoded;
    // Some hundred thousand pixels say all there is; a lattice that follows no row or column.
    const std::size_t pixels = static_cast<std::size_t>(first.width) * static_cast<std::size_t>(first.height);
    step_ = std::max<std::size_t>(1, pixels / 200000);
    pixels_ = pixels;
  }

  /// Of every kFolds-th pixel, from the one of this number on.
  Equations equations(const Codes& g, const Noise& noise, Trust trust, std::size_t fold) const {
    Equations e;
    const Forward forward(g);
    for_each_pixel(forward, noise, trust, fold, [&](const std::vector<Reading>& readings, double sum) {
      double mean = 0;
      for (const Reading& r : readings) mean += r.weight * r.constant / sum;
      for (const Reading& r : readings) {
        const double off = r.constant - mean;
        e.c += r.weight * off * off;
        for (int k = 0; k < 2; ++k) e.b[r.code + k] += r.weight * r.share[k] * off;
        for (int k = 0; k < 2; ++k)
          for (int l = 0; l < 2; ++l) e.a(r.code + k, r.code + l) += r.weight * r.share[k] * r.share[l];
        for (const Reading& o : readings)
          for (int k = 0; k < 2; ++k)
            for (int l = 0; l < 2; ++l)
              e.a(r.code + k, o.code + l) -= r.weight * r.share[k] * o.weight * o.share[l] / sum;
      }
      e.freedom += static_cast<double>(readings.size()) - 1;
    });
    return e;
  }

  /// Of readings from their pixels' fits; a quarter of the pixels says enough.
  Noise::Sums distances(const Codes& g, const Noise& noise) const {
    Noise::Sums sums;
    for_each_pixel(Forward(g), noise, Trust::fits, 0, [&](const std::vector<Reading>& readings, double sum) {
      for (const Reading& r : readings) sums.add(r.at, r.distance, 1 - r.weight / sum);
    });
    return sums;
  }

  /// Median distance between what a pixel's exposures say and their mean, of ln(linear).
  double median_residual(const Codes& g, const Noise& noise) const {
    std::vector<float> shares;
    const Forward forward(g);
    for (std::size_t fold = 0; fold < kFolds; ++fold)
      for_each_pixel(forward, noise, Trust::fits, fold, [&](const std::vector<Reading>& readings, double sum) {
        const auto off = [&](const Reading& r) {
          return r.share[0] * g[r.code] + r.share[1] * g[r.code + 1] - r.constant;
        };
        double mean = 0;
        for (const Reading& r : readings) mean += r.weight * off(r) / sum;
        for (const Reading& r : readings) shares.push_back(static_cast<float>(std::abs(off(r) - mean)));
      });
    if (shares.empty()) return 0;
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    return *middle;
  }

 private:
  /// One equation: share · g at two codes = E + constant.
  struct Reading {
    int code = 0;
    std::array<double, 2> share{};
    double constant = 0, weight = 0;
    double at = 0, distance = 0;  ///< where it is put, and how far from there it is
  };

  /// Calls with every pixel that was neither clipped nor black at two exposures or more.
  template <typename Function>
  void for_each_pixel(const Forward& forward, const Noise& noise, Trust trust, std::size_t fold,
                      const Function& function) const {
    constexpr double kLeastFromEnds = 3;
    std::vector<double> z(pictures_.size());
    std::vector<Reading> readings;
    for (std::size_t pixel = fold * step_; pixel < pixels_; pixel += kFolds * step_) {
      readings.clear();
      for (std::size_t i = 0; i < pictures_.size(); ++i) {
        z[i] = pictures_[i].encoded.data[3 * pixel + static_cast<std::size_t>(channel_)];
        if (noise.is_within(z[i], kFromEnds, kLeastFromEnds))
          readings.push_back(reading(forward, z[i], z[i], ln_exposure_[i], noise));
      }
      if (trust == Trust::fits && readings.size() >= 2) fit(forward, noise, z, readings);
      double sum = 0;
      for (const Reading& r : readings) sum += r.weight;
      if (readings.size() >= 2) function(readings, sum);
    }
  }

  /// `z` where the curve puts it at `code`.
  static Reading reading(const Forward& forward, double z, double code, double ln_exposure, const Noise& noise) {
    const int low = std::min(static_cast<int>(code), kCodes - 2);
    const double slope = forward.slope(code);
    const double sigma = slope * noise.at(code);
    return {low, {low + 1 - code, code - low}, ln_exposure - slope * (z - code), 1 / (sigma * sigma), code, z - code};
  }

  /// Where the curve puts the readings of the light that fits them best. All that are not clipped tell the light, and
  /// those that it puts near an end are left out: what is left of noise then does not depend on where that is.
  void fit(const Forward& forward, const Noise& noise, const std::vector<double>& z,
           std::vector<Reading>& readings) const {
    double light = 0, sum = 0;
    for (const Reading& r : readings) {
      light += r.weight * (forward.ln(r.code) - r.constant);
      sum += r.weight;
    }
    light /= sum;
    const auto clipped = [&](std::size_t i) { return z[i] < 1 || z[i] > kCodes - 2; };
    constexpr int kSteps = 3;
    for (int step = 0; step < kSteps; ++step) {
      double all = 0, pull = 0;
      for (std::size_t i = 0; i < z.size(); ++i) {
        if (clipped(i)) continue;
        const double code = forward.code(light + ln_exposure_[i]), per_ln = 1 / forward.slope(code);
        const double trust = 1 / (noise.at(code) * noise.at(code));
        all += trust * per_ln * per_ln;
        pull += trust * per_ln * (z[i] - code);
      }
      light += pull / all;
    }
    readings.clear();
    for (std::size_t i = 0; i < z.size(); ++i) {
      const double code = forward.code(light + ln_exposure_[i]);
      if (!clipped(i) && noise.is_within(code, kFitFromEnds, 0))
        readings.push_back(reading(forward, z[i], code, ln_exposure_[i], noise));
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
    const capture::Image<std::uint8_t>& first = pictures.front().encoded;
    if (picture.encoded.width != first.width || picture.encoded.height != first.height)
      throw capture::InputError("exposure sweep: found pictures of two sizes, allowed: one");
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
    Noise noise;
    std::array<Equations, kFolds> folds;
    Equations measured;
    for (int round = 0; round < kRounds; ++round) {  // what readings say follows the curve and the noise
      measured = {};
      for (std::size_t fold = 0; fold < kFolds; ++fold)
        measured += folds[fold] =
            channel.equations(g, noise, round < kFirstRounds ? Trust::readings : Trust::fits, fold);
      if (round + 1 == kRounds) break;
      constexpr double kUsual = 1e8;
      g = solver_of(measured, kUsual).solve(measured.b);
      if (round >= kFirstRounds) noise.learn(channel.distances(g, noise));
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
    result.residual = std::max(result.residual, channel.median_residual(g, noise));
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

}  // namespace lumigraft::reconstruct
