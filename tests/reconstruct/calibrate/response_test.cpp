// The response estimated from pictures of known light at known exposures.
#include "reconstruct/calibrate/response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <random>
#include <utility>

#include "capture/camera/response.h"
#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::reconstruct {
namespace {

using Curve = std::function<double(double)>;  // linear to encoded, both in [0, 1]

double srgb(double linear) { return capture::linear_to_srgb(static_cast<float>(linear)); }
double gamma(double linear) { return std::pow(std::min(linear, 1.0), 1 / 2.2); }
double filmic(double linear) { return std::min(1.0, 1.25 * linear / (linear + 0.25)); }
double logarithm(double linear) { return std::log1p(60 * std::min(linear, 1.0)) / std::log(61.0); }
/// Rec. 709's curve with a knee, as in camcorders.
double knee(double linear) {
  const double x = std::min(linear, 1.0), y = x < 0.018 ? 4.5 * x : 1.099 * std::pow(x, 0.45) - 0.099;
  return (1 - std::exp(-2.2 * y)) / (1 - std::exp(-2.2));
}
/// Increased mid-tone contrast, as in pictures for display.
double contrast(double linear) {
  const double y = srgb(linear);
  return y + 0.35 * y * (1 - y) * (2 * y - 1);
}

/// Hybrid log-gamma (ITU-R BT.2100).
double hlg(double linear) {
  const double x = std::min(linear, 1.0);
  return x <= 1.0 / 12 ? std::sqrt(3 * x) : 0.17883277 * std::log(12 * x - 0.28466892) + 0.55991073;
}
/// Narkowicz's fit of ACES (2015), then sRGB.
double aces(double linear) {
  const auto fit = [](double x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); };
  return srgb(std::min(1.0, fit(2 * std::min(linear, 1.0)) / fit(2.0)));
}
/// A soft toe as in film prints, then a power.
double toe(double linear) {
  const double x = std::min(linear, 1.0);
  return std::pow(x * (x + 0.02) / (x + 0.06) * 1.06 / 1.02, 1 / 1.8);
}

/// A scene over four orders of magnitude at doubling exposures, with sensor noise.
std::vector<ExposedPicture> sweep(const Curve& curve, double noise_codes, int exposures = 8) {
  constexpr int kSide = 160;
  std::vector<ExposedPicture> pictures;
  std::mt19937 random(5);
  std::normal_distribution<double> gauss(0, noise_codes);
  for (int i = 0; i < exposures; ++i) {
    ExposedPicture& picture = pictures.emplace_back();
    picture.exposure = 0.02 * std::pow(2.0, i);
    picture.encoded = capture::Image<std::uint8_t>(kSide, kSide, 3);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        for (int c = 0; c < 3; ++c) {
          const double radiance = std::pow(10.0, -2.5 + 4.0 * (y * kSide + x) / (kSide * kSide)) * (1 + 0.2 * c);
          const double code = 255 * curve(picture.exposure * radiance) + (noise_codes > 0 ? gauss(random) : 0);
          picture.encoded.at(x, y, c) = static_cast<std::uint8_t>(std::clamp(std::lround(code), 0l, 255l));
        }
  }
  return pictures;
}

/// The true linear value of a pixel value, by bisection.
double inverse(const Curve& curve, int code) {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (255 * curve(middle) < code ? low : high) = middle;
  }
  return low;
}

TEST(CalibrateResponse, IsFoundToAPercent) {
  const std::pair<const char*, Curve> curves[] = {{"srgb", srgb},
                                                  {"gamma", gamma},
                                                  {"linear", [](double x) { return std::min(x, 1.0); }},
                                                  {"filmic", filmic},
                                                  {"logarithm", logarithm},
                                                  {"knee", knee},
                                                  {"contrast", contrast},
                                                  {"hlg", hlg},
                                                  {"toe", toe}};
  for (const auto& [name, curve] : curves) {
    const ResponseCalibration found = calibrate_response(sweep(curve, 0.6));
    EXPECT_EQ(found.refusal, "") << name;
    double worst = 0, worst_relative = 0;
    for (std::size_t c = 0; c < 3; ++c)
      for (int z = 0; z < 256; ++z) {
        const double truth = inverse(curve, z), is = found.linear[c][static_cast<std::size_t>(z)];
        worst = std::max(worst, std::abs(is - truth));
        if (z >= 24) worst_relative = std::max(worst_relative, std::abs(is / truth - 1));
      }
    std::printf("%s: off by %.4f of white at worst, by %.2f %% of itself from code 24 up\n", name, worst,
                100 * worst_relative);
    EXPECT_LT(worst, 0.01) << name;
    EXPECT_LT(worst_relative, 0.01) << name;
  }
}

/// Readings within some σ of 255 do not count, because noise is clipped there. A curve with strong curvature there is
/// known up to a factor only: its value at 255, and so the unit of exposure, is extrapolated.
TEST(CalibrateResponse, AHardShoulderCostsAFactorAlone) {
  struct Case {
    const char* name;
    Curve curve;
    double noise_codes, largest_factor;
  };
  for (const Case& one : {Case{"aces", aces, 0.6, 1.06}, Case{"knee", knee, 1.5, 1.02}}) {
    const ResponseCalibration found = calibrate_response(sweep(one.curve, one.noise_codes));
    EXPECT_EQ(found.refusal, "");
    const auto ratio = [&](int z) { return found.linear[1][static_cast<std::size_t>(z)] / inverse(one.curve, z); };
    double worst = 0;
    for (int z = 24; z <= 245; ++z) worst = std::max(worst, std::abs(ratio(z) / ratio(128) - 1));
    std::printf("%s, noise of %.1f codes: off by a factor of %.3f, and by %.2f %% relative to it\n", one.name,
                one.noise_codes, ratio(128), 100 * worst);
    EXPECT_LT(worst, 0.01) << one.name;
    EXPECT_NEAR(ratio(128), 1, one.largest_factor - 1) << one.name;
  }
}

TEST(CalibrateResponse, ANoisySensorIsFoundToAPercent) {
  const std::pair<const char*, Curve> curves[] = {{"srgb", srgb},
                                                  {"gamma", gamma},
                                                  {"linear", [](double x) { return std::min(x, 1.0); }},
                                                  {"filmic", filmic},
                                                  {"logarithm", logarithm},
                                                  {"contrast", contrast},
                                                  {"hlg", hlg},
                                                  {"toe", toe}};
  for (const auto& [name, curve] : curves) {
    const ResponseCalibration found = calibrate_response(sweep(curve, 1.5));
    EXPECT_EQ(found.refusal, "") << name;
    double worst = 0;
    for (int z = 24; z < 256; ++z)
      worst = std::max(worst, std::abs(found.linear[1][static_cast<std::size_t>(z)] / inverse(curve, z) - 1));
    std::printf("%s, noise of 1.5 codes: off by %.2f %% of itself at worst, from code 24 up\n", name, 100 * worst);
    EXPECT_LT(worst, 0.01) << name;
  }
}

TEST(CalibrateResponse, RefusesWhatSaysTooLittle) {
  EXPECT_EQ(calibrate_response(sweep(srgb, 0.6, 2)).refusal.find("exposures: found 2 pictures"), 0u);
  EXPECT_NE(calibrate_response({}).refusal, "");
  auto dim = sweep(srgb, 0.6, 4);
  for (ExposedPicture& picture : dim)
    for (std::uint8_t& code : picture.encoded.data) code = std::min<std::uint8_t>(code, 120);
  EXPECT_EQ(calibrate_response(dim).refusal.find("coverage: found code values"), 0u) << calibrate_response(dim).refusal;
  auto automatic = sweep(srgb, 0.6);
  std::mt19937 random(1);
  for (ExposedPicture& picture : automatic) picture.exposure *= 0.5 + static_cast<double>(random() % 1000) / 1000;
  EXPECT_EQ(calibrate_response(automatic).refusal.find("residual: found exposures"), 0u)
      << calibrate_response(automatic).refusal;
  auto sizes = sweep(srgb, 0.6);
  sizes[1].encoded = capture::Image<std::uint8_t>(10, 10, 3);
  EXPECT_THROW(calibrate_response(sizes), capture::InputError);
}

class CalibrateResponseFile : public test::ScratchFolder {};

TEST_F(CalibrateResponseFile, IsWhatACameraTakes) {
  const ResponseCalibration found = calibrate_response(sweep(gamma, 0.6));
  {
    std::ofstream out(folder_ / "response.txt");
    write_response_file(out, found);
  }
  const capture::Response response = capture::Response::from_file(folder_ / "response.txt");
  EXPECT_NEAR(response.to_linear(128, 2), found.linear[2][128], 1e-6);
  EXPECT_EQ(response.to_linear(255), 1.0f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
