#include "reconstruct/calibrate/response.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "capture/message_text.h"
#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

constexpr int kCodes = 256;
constexpr auto& kCurve = kCalibration.response;

using Codes = Eigen::VectorXd;   // one number per pixel value
using Normal = Eigen::MatrixXd;  // one per pair of pixel values

/// ln(linear) of sRGB, the initial curve.
Codes reference_ln() {
  Codes g(kCodes);
  for (int z = 0; z < kCodes; ++z)
    g[z] = std::log(capture::srgb_table().linear[static_cast<std::size_t>(std::max(z, 1))]);
  return g;
}

/// 1σ of a reading in pixel values, as a function of the pixel value: photon noise grows with the square root of light,
/// and a curve that is steep in the dark amplifies it up to ten times compared with near white. Estimated in bins and
/// interpolated linearly.
class Noise {
 public:
  Noise() { sigma_.fill(kCurve.first_noise); }
  double at(double code) const {
    const double x = std::clamp(code / kBin - 0.5, 0.0, kBins - 1.0);
    const auto low = std::min(static_cast<std::size_t>(x), kBins - 2);
    return sigma_[low] + (x - static_cast<double>(low)) * (sigma_[low + 1] - sigma_[low]);
  }
  /// Whether a reading is at least this far from both ends of the scale.
  bool is_within(double code, double sigmas, double min_codes) const {
    const double from_ends = std::max(min_codes, sigmas * at(code));
    return code >= from_ends && code <= kCodes - 1 - from_ends;
  }

  /// Squared residuals of readings from their pixels' fits, and the fraction of their noise that remains in the
  /// residuals.
  struct Sums {
    std::array<double, 16> square{}, left{};
    void add(double code, double distance, double left_fraction) {
      const auto bin = static_cast<std::size_t>(std::clamp(code / kBin, 0.0, kBins - 1.0));
      square[bin] += distance * distance;
      left[bin] += left_fraction;
    }
  };
  /// Bins with too few readings take the value of the nearest bin.
  void learn(const Sums& sums) {
    std::array<double, kBins> found{};
    for (std::size_t i = 0; i < kBins; ++i)
      if (sums.left[i] > kCurve.min_bin_readings)
        found[i] = std::clamp(std::sqrt(sums.square[i] / sums.left[i]), kCurve.min_noise, kCurve.max_noise);
    if (*std::max_element(found.begin(), found.end()) == 0) return;
    for (std::size_t i = 0; i < kBins; ++i) {
      const auto below = [&](std::size_t off) { return i >= off ? found[i - off] : 0; };
      const auto above = [&](std::size_t off) { return i + off < kBins ? found[i + off] : 0; };
      std::size_t off = 0;
      while (below(off) == 0 && above(off) == 0) ++off;
      sigma_[i] = below(off) > 0 ? below(off) : above(off);
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

  /// The sum for a curve g.
  double misfit(const Codes& g) const { return g.dot(a * g) - 2 * b.dot(g) + c; }
  Equations& operator+=(const Equations& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    freedom += other.freedom;
    return *this;
  }
};

/// Evaluates a curve from light to pixel values.
class Forward {
 public:
  explicit Forward(const Codes& ln_linear) : ln_(ln_linear), slope_(kCodes) {
    static const Codes usual = reference_ln();
    ln_[0] = ln_[1] - 1;  // code 0 is no logarithm's
    for (int z = 1; z < kCodes; ++z) ln_[z] = std::max(ln_[z], ln_[z - 1] + 1e-6);
    for (int z = 1; z + 1 < kCodes; ++z) {
      const double usual_slope = 0.5 * (usual[z + 1] - usual[z - 1]);
      slope_[z] = std::clamp(0.5 * (ln_[z + 1] - ln_[z - 1]), usual_slope / kCurve.max_slope_ratio,
                             usual_slope * kCurve.max_slope_ratio);
    }
    slope_[0] = slope_[1];
    slope_[kCodes - 1] = slope_[kCodes - 2];
  }
  /// The fractional pixel value of some light, limited to the scale.
  double code(double ln_light) const {
    const auto above = std::upper_bound(ln_.begin(), ln_.end(), ln_light);
    if (above == ln_.begin()) return 0;
    if (above == ln_.end()) return kCodes - 1;
    const auto z = above - ln_.begin();
    return static_cast<double>(z - 1) + (ln_light - ln_[z - 1]) / (ln_[z] - ln_[z - 1]);
  }
  double ln(double code) const { return ln_[static_cast<Eigen::Index>(std::lround(code))]; }
  /// Derivative of ln(light) by the pixel value.
  double slope(double code) const { return slope_[static_cast<Eigen::Index>(std::lround(code))]; }

 private:
  Codes ln_, slope_;
};

/// Where the curve is linearised: at the readings, or at the values that fit a pixel's light.
enum class Trust { readings, fits };

/// Residuals are in pixel values, where noise has no bias; in ln(linear) it would bias dark readings down. Each pixel's
/// light is fitted to its readings with the current curve, and the equations are Gauss-Newton's for Σ (z - f(E + ln
/// e))², f the inverse of the curve. Readings are weighted and selected by their fitted values, which are independent
/// of the residuals; selection by measured values would be biased by noise.
class Channel {
 public:
  Channel(const std::vector<ExposedPicture>& pictures, int channel) : pictures_(pictures), channel_(channel) {
    for (const ExposedPicture& picture : pictures) ln_exposure_.push_back(std::log(picture.exposure));
    const capture::Image<std::uint8_t>& first = pictures.front().encoded;
    // The step does not follow rows or columns.
    pixels_ = static_cast<std::size_t>(first.width) * static_cast<std::size_t>(first.height);
    step_ = std::max<std::size_t>(1, pixels_ / kCurve.max_pixels);
  }

  /// Normal equations of one fold: every `folds`-th pixel, starting at `fold`.
  Equations equations(const Codes& g, const Noise& noise, Trust trust, std::size_t fold) const {
    Equations e;
    const Forward forward(g);
    for_each_pixel(forward, noise, trust, fold, [&](const std::vector<Reading>& readings, double sum) {
      double mean = 0;
      for (const Reading& r : readings) mean += r.weight * r.constant / sum;
      for (const Reading& r : readings) {
        const double off = r.constant - mean;
        e.c += r.weight * off * off;
        for (int k = 0; k < 2; ++k) e.b[r.code + k] += r.weight * r.interpolation[k] * off;
        for (int k = 0; k < 2; ++k)
          for (int l = 0; l < 2; ++l) e.a(r.code + k, r.code + l) += r.weight * r.interpolation[k] * r.interpolation[l];
        for (const Reading& o : readings)
          for (int k = 0; k < 2; ++k)
            for (int l = 0; l < 2; ++l)
              e.a(r.code + k, o.code + l) -= r.weight * r.interpolation[k] * o.weight * o.interpolation[l] / sum;
      }
      e.freedom += static_cast<double>(readings.size()) - 1;
    });
    return e;
  }

  /// Residuals of the readings from their pixels' fits; one fold is enough.
  Noise::Sums distances(const Codes& g, const Noise& noise) const {
    Noise::Sums sums;
    for_each_pixel(Forward(g), noise, Trust::fits, 0, [&](const std::vector<Reading>& readings, double sum) {
      for (const Reading& r : readings) sums.add(r.at, r.distance, 1 - r.weight / sum);
    });
    return sums;
  }

  /// Median deviation in ln(linear) of a pixel's readings at its exposures from their mean.
  double median_residual(const Codes& g, const Noise& noise) const {
    std::vector<float> residuals;
    const Forward forward(g);
    for (std::size_t fold = 0; fold < kCurve.folds; ++fold)
      for_each_pixel(forward, noise, Trust::fits, fold, [&](const std::vector<Reading>& readings, double sum) {
        const auto off = [&](const Reading& r) {
          return r.interpolation[0] * g[r.code] + r.interpolation[1] * g[r.code + 1] - r.constant;
        };
        double mean = 0;
        for (const Reading& r : readings) mean += r.weight * off(r) / sum;
        for (const Reading& r : readings) residuals.push_back(static_cast<float>(std::abs(off(r) - mean)));
      });
    return median(residuals);
  }

 private:
  /// One equation: share · g at two pixel values = E + constant.
  struct Reading {
    int code = 0;
    std::array<double, 2> interpolation{};
    double constant = 0, weight = 0;
    double at = 0, distance = 0;  ///< fitted pixel value, and the reading's residual from it
  };

  /// Calls `function` for every pixel with at least two readings that are neither clipped nor black.
  template <typename Function>
  void for_each_pixel(const Forward& forward, const Noise& noise, Trust trust, std::size_t fold,
                      const Function& function) const {
    std::vector<double> z(pictures_.size());
    std::vector<Reading> readings;
    for (std::size_t pixel = fold * step_; pixel < pixels_; pixel += kCurve.folds * step_) {
      readings.clear();
      for (std::size_t i = 0; i < pictures_.size(); ++i) {
        z[i] = pictures_[i].encoded.data[3 * pixel + static_cast<std::size_t>(channel_)];
        if (noise.is_within(z[i], kCurve.measured_sigmas, kCurve.min_measured_codes))
          readings.push_back(reading(forward, z[i], z[i], ln_exposure_[i], noise));
      }
      if (trust == Trust::fits && readings.size() >= 2) fit(forward, noise, z, readings);
      double sum = 0;
      for (const Reading& r : readings) sum += r.weight;
      if (readings.size() >= 2) function(readings, sum);
    }
  }

  /// The equation of the reading `z`, linearised at `code`.
  static Reading reading(const Forward& forward, double z, double code, double ln_exposure, const Noise& noise) {
    const int low = std::min(static_cast<int>(code), kCodes - 2);
    const double slope = forward.slope(code);
    const double sigma = slope * noise.at(code);
    return {low, {low + 1 - code, code - low}, ln_exposure - slope * (z - code), 1 / (sigma * sigma), code, z - code};
  }

  /// Replaces the readings by their fitted values for the light that fits them best. The fit uses all unclipped
  /// readings; those with fitted values near an end are then left out, so that the remaining noise does not depend on
  /// the fitted value.
  void fit(const Forward& forward, const Noise& noise, const std::vector<double>& z,
           std::vector<Reading>& readings) const {
    double light = 0, sum = 0;
    for (const Reading& r : readings) {
      light += r.weight * (forward.ln(r.code) - r.constant);
      sum += r.weight;
    }
    light /= sum;
    const auto clipped = [&](std::size_t i) { return z[i] < 1 || z[i] > kCodes - 2; };
    for (int step = 0; step < kCurve.light_steps; ++step) {
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
      if (!clipped(i) && noise.is_within(code, kCurve.fitted_sigmas, 0))
        readings.push_back(reading(forward, z[i], code, ln_exposure_[i], noise));
    }
  }

  const std::vector<ExposedPicture>& pictures_;
  int channel_;
  std::vector<double> ln_exposure_;
  std::size_t pixels_ = 0, step_ = 1;
};

/// The smoothness prior: fourth differences of ln(linear) are small, the more so the brighter; this holds for power
/// laws and for toes and shoulders. Where all exposures are powers of one ratio, only the prior excludes a curve with a
/// ripple of that period in ln(linear), which fits the pictures equally well.
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

/// Selects the strongest smoothing whose error on the left-out pixels is within one standard error of the minimum
/// (Breiman et al. 1984, "Classification and Regression Trees", §3.4.3): the minimum itself overfits noise at dark
/// pixel values.
double strength_by_cross_validation(const std::array<Equations, kCurve.folds>& folds, const Equations& all) {
  std::vector<std::pair<double, double>> tried;  // strength, misfit
  double min_misfit = std::numeric_limits<double>::infinity();
  for (double strength = kCurve.min_strength; strength < 1.1 * kCurve.max_strength; strength *= kCurve.strength_step) {
    double misfit = 0;
    for (const Equations& fold : folds) {
      Equations others = all;
      others.a -= fold.a;
      others.b -= fold.b;
      misfit += fold.misfit(solver_of(others, strength).solve(others.b));
    }
    tried.emplace_back(strength, misfit);
    min_misfit = std::min(min_misfit, misfit);
  }
  double smoothest = kCurve.min_strength;
  for (const auto& [strength, misfit] : tried)
    if (misfit <= min_misfit * (1 + std::sqrt(2 / std::max(all.freedom, 1.0)))) smoothest = strength;
  return smoothest;
}

}  // namespace

ResponseCalibration calibrate_response(const std::vector<ExposedPicture>& pictures) {
  ResponseCalibration result;
  double shortest = 0, longest = 0;
  for (const ExposedPicture& picture : pictures) {
    const capture::Image<std::uint8_t>& first = pictures.front().encoded;
    if (picture.encoded.width != first.width || picture.encoded.height != first.height)
      throw capture::InputError("exposure sweep: found pictures of two sizes, allowed: one");
    shortest = shortest > 0 ? std::min(shortest, picture.exposure) : picture.exposure;
    longest = std::max(longest, picture.exposure);
  }
  if (pictures.size() < kCurve.min_pictures || !(longest >= kCurve.min_exposure_ratio * shortest)) {
    result.refusal = capture::formatted(
        "exposures: found %zu pictures, the longest exposure %.1f times the shortest, allowed: at least %zu and "
        "%.0f times",
        pictures.size(), shortest > 0 ? longest / shortest : 0.0, kCurve.min_pictures, kCurve.min_exposure_ratio);
    return result;
  }
  result.darkest = 0;
  result.brightest = 255;
  for (int c = 0; c < 3; ++c) {
    const Channel channel(pictures, c);
    Codes g = reference_ln();
    Noise noise;
    std::array<Equations, kCurve.folds> folds;
    Equations measured;
    for (int round = 0; round < kCurve.rounds; ++round) {  // the equations depend on the curve and the noise
      measured = {};
      for (std::size_t fold = 0; fold < kCurve.folds; ++fold)
        measured += folds[fold] =
            channel.equations(g, noise, round < kCurve.first_rounds ? Trust::readings : Trust::fits, fold);
      if (round + 1 == kCurve.rounds) break;
      g = solver_of(measured, kCurve.usual_strength).solve(measured.b);
      if (round >= kCurve.first_rounds) noise.learn(channel.distances(g, noise));
    }
    const auto solver = solver_of(measured, strength_by_cross_validation(folds, measured));
    g = solver.solve(measured.b);
    int low = kCodes - 1, high = 0;
    const double enough = kCurve.min_information * measured.a.diagonal().maxCoeff();
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
  if (result.darkest > kCurve.max_darkest || result.brightest < kCurve.min_brightest) {
    result.refusal = capture::formatted(
        "coverage: found code values %d to %d alone at two exposures or more, allowed: at most %d to at least "
        "%d; show dark and bright things, and more exposures",
        result.darkest, result.brightest, kCurve.max_darkest, kCurve.min_brightest);
  } else if (!(result.residual <= kCurve.max_residual)) {
    result.refusal = capture::formatted(
        "residual: found exposures that differ by %.0f %% in the median from what they are said to be, allowed: "
        "at most %.0f %%; did something move, or is a control automatic?",
        100 * result.residual, 100 * kCurve.max_residual);
  }
  return result;
}

void write_response_file(std::ostream& out, const ResponseCalibration& calibration) {
  out << "# Written by lumigraft calibrate: linear values of R, G and B by code value\n";
  for (std::size_t z = 0; z < kCodes; ++z) {
    out << capture::formatted("%.7f %.7f %.7f\n", calibration.linear[0][z], calibration.linear[1][z],
                              calibration.linear[2][z]);
  }
}

}  // namespace lumigraft::reconstruct
