#include "server/bench/flip.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "capture/camera/srgb.h"

namespace lumigraft::server {
namespace {

using Planes = std::array<capture::Image<float>, 3>;

constexpr double kColourExponent = 0.7;        // q_c, sec. 4.1.3
constexpr double kKnee = 0.4, kAtKnee = 0.95;  // p_c, p_t, sec. 4.1.3
constexpr double kFeatureExponent = 0.5;       // q_f, sec. 4.2
constexpr double kFeatureWidth_degrees = 0.082;

/// Sum of two Gaussians over visual angle, the inverse transform of a contrast sensitivity function (table 1):
/// a sqrt(π/b) exp(-π² x² / b). b in degrees².
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr Sensitivity kAchromatic{1.0, 0.0047, 0.0, 1e-5};
constexpr Sensitivity kRedGreen{1.0, 0.0053, 0.0, 1e-5};
constexpr Sensitivity kBlueYellow{34.1, 0.04, 13.5, 0.025};

const Eigen::Matrix3d& xyz_of_rgb() {  // IEC 61966-2-1
  static const Eigen::Matrix3d m =
      (Eigen::Matrix3d() << 10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0,
       2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0, 1425312.0 / 73733382.0,
       8788810.0 / 73733382.0, 70074185.0 / 73733382.0)
          .finished();
  return m;
}

/// XYZ relative to the white point (D65).
Eigen::Vector3d relative_xyz(const Eigen::Vector3d& rgb) {
  static const Eigen::Vector3d white = xyz_of_rgb() * Eigen::Vector3d::Ones();
  return (xyz_of_rgb() * rgb).cwiseQuotient(white);
}

/// Linearised CIELab: spatial filters need a space linear in light (eq. 4).
Eigen::Vector3d ycxcz(const Eigen::Vector3d& rgb) {
  const Eigen::Vector3d xyz = relative_xyz(rgb);
  return {116.0 * xyz.y() - 16.0, 500.0 * (xyz.x() - xyz.y()), 200.0 * (xyz.y() - xyz.z())};
}

Eigen::Vector3d rgb_of_ycxcz(const Eigen::Vector3d& c) {
  static const Eigen::Vector3d white = xyz_of_rgb() * Eigen::Vector3d::Ones();
  static const Eigen::Matrix3d rgb_of_xyz = xyz_of_rgb().inverse();
  const double y = (c.x() + 16.0) / 116.0;
  return rgb_of_xyz * Eigen::Vector3d(c.y() / 500.0 + y, y, y - c.z() / 200.0).cwiseProduct(white);
}

/// CIELab with the Hunt effect: chroma decreases with lightness (eq. 6).
Eigen::Vector3d hunt_lab(const Eigen::Vector3d& rgb) {
  constexpr double d = 6.0 / 29.0;
  const Eigen::Vector3d f = relative_xyz(rgb).unaryExpr(
      [](double t) { return t > d * d * d ? std::cbrt(t) : t / (3.0 * d * d) + 4.0 / 29.0; });
  const double lightness = 116.0 * f.y() - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (f.x() - f.y()), 0.01 * lightness * 200.0 * (f.y() - f.z())};
}

/// HyAB (eq. 7), compressed.
double colour_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::pow(std::abs(a.x() - b.x()) + std::hypot(a.y() - b.y(), a.z() - b.z()), kColourExponent);
}

/// Eq. 9: expands the range of distances that natural images use.
double redistribute(double distance) {
  static const double largest = colour_distance(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1}));
  const double knee = kKnee * largest;
  return distance < knee ? distance * kAtKnee / knee : kAtKnee + (distance - knee) / (largest - knee) * (1.0 - kAtKnee);
}

/// Separable convolution; border pixels are replicated.
capture::Image<float> convolve(const capture::Image<float>& in, const std::vector<double>& along_x,
                               const std::vector<double>& along_y) {
  const auto pass = [](const capture::Image<float>& from, const std::vector<double>& weights, bool horizontal) {
    const int radius = static_cast<int>(weights.size() / 2);
    capture::Image<float> to(from.width, from.height, 1);
    for (int y = 0; y < from.height; ++y) {
      for (int x = 0; x < from.width; ++x) {
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) {
          const int u = horizontal ? std::clamp(x + i, 0, from.width - 1) : x;
          const int v = horizontal ? y : std::clamp(y + i, 0, from.height - 1);
          sum += weights[static_cast<std::size_t>(i + radius)] * from.at(u, v);
        }
        to.at(x, y) = static_cast<float>(sum);
      }
    }
    return to;
  };
  return pass(pass(in, along_x, true), along_y, false);
}

double total(const std::vector<double>& weights) { return std::accumulate(weights.begin(), weights.end(), 0.0); }

std::vector<double> sampled(int radius, const std::function<double(double)>& function) {
  std::vector<double> weights;
  for (int i = -radius; i <= radius; ++i) weights.push_back(function(i));
  return weights;
}

/// Filters a channel by its contrast sensitivity (sec. 4.1.1).
capture::Image<float> seen(const capture::Image<float>& channel, const Sensitivity& s) {
  constexpr double pi2 = std::numbers::pi * std::numbers::pi;
  const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(kBlueYellow.b1 / (2.0 * pi2)) * kFlipPixelsPerDegree));
  const auto gaussian = [&](double b) {
    return sampled(radius, [b](double i) {
      const double x_degrees = i / kFlipPixelsPerDegree;
      return std::exp(-pi2 * x_degrees * x_degrees / b);
    });
  };
  const std::vector<double> g1 = gaussian(s.b1), g2 = gaussian(s.b2);
  const double w1 = s.a1 * std::sqrt(std::numbers::pi / s.b1), w2 = s.a2 * std::sqrt(std::numbers::pi / s.b2);
  const double sum = w1 * total(g1) * total(g1) + w2 * total(g2) * total(g2);
  capture::Image<float> result = convolve(channel, g1, g1);
  const capture::Image<float> second =
      w2 > 0 ? convolve(channel, g2, g2) : capture::Image<float>(channel.width, channel.height, 1);
  for (std::size_t i = 0; i < result.data.size(); ++i) {
    result.data[i] = static_cast<float>((w1 * result.data[i] + w2 * second.data[i]) / sum);
  }
  return result;
}

Planes ycxcz_planes(const capture::Image<float>& srgb) {
  Planes planes;
  planes.fill(capture::Image<float>(srgb.width, srgb.height, 1));
  for (std::size_t i = 0; i < planes[0].data.size(); ++i) {
    Eigen::Vector3d rgb;
    for (int c = 0; c < 3; ++c) rgb[c] = capture::srgb_to_linear(srgb.data[3 * i + static_cast<std::size_t>(c)]);
    const Eigen::Vector3d value = ycxcz(rgb);
    for (int c = 0; c < 3; ++c) planes[static_cast<std::size_t>(c)].data[i] = static_cast<float>(value[c]);
  }
  return planes;
}

/// Edges and points of the achromatic channel: magnitudes of its first and second derivatives (sec. 4.2).
struct Features {
  capture::Image<float> edges, points;
};

/// Scales the weights: positive ones sum to 1, negative ones to -1.
std::vector<double> balanced(std::vector<double> weights) {
  double positive = 0, negative = 0;
  for (const double w : weights) (w > 0 ? positive : negative) += w;
  for (double& w : weights) w /= w > 0 ? positive : -negative;
  return weights;
}

Features features_of(const capture::Image<float>& achromatic) {
  capture::Image<float> lightness = achromatic;
  for (float& y : lightness.data) y = (y + 16.0f) / 116.0f;
  const double sigma = 0.5 * kFeatureWidth_degrees * kFlipPixelsPerDegree;
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  const auto gaussian = [sigma](double x) { return std::exp(-x * x / (2.0 * sigma * sigma)); };
  std::vector<double> blur = sampled(radius, gaussian);
  const double sum = total(blur);
  for (double& w : blur) w /= sum;
  const std::vector<double> slope = balanced(sampled(radius, [&](double x) { return -x * gaussian(x); }));
  const std::vector<double> bend =
      balanced(sampled(radius, [&](double x) { return (x * x / (sigma * sigma) - 1.0) * gaussian(x); }));
  const auto length = [&](const std::vector<double>& derivative) {
    capture::Image<float> across = convolve(lightness, derivative, blur);
    const capture::Image<float> down = convolve(lightness, blur, derivative);
    for (std::size_t i = 0; i < across.data.size(); ++i) across.data[i] = std::hypot(across.data[i], down.data[i]);
    return across;
  };
  return {length(slope), length(bend)};
}

Eigen::Vector3d seen_colour(const Planes& filtered, std::size_t i) {
  const Eigen::Vector3d rgb = rgb_of_ycxcz({filtered[0].data[i], filtered[1].data[i], filtered[2].data[i]});
  return hunt_lab(rgb.cwiseMax(0.0).cwiseMin(1.0));
}

}  // namespace

double mean_flip(const capture::Image<float>& reference, const capture::Image<float>& test) {
  if (reference.width != test.width || reference.height != test.height || reference.channels != 3 ||
      test.channels != 3 || reference.empty()) {
    throw std::logic_error("mean_flip: two R G B pictures of one size are compared");
  }
  const Planes a = ycxcz_planes(reference), b = ycxcz_planes(test);
  const auto filter = [](const Planes& p) {
    return Planes{seen(p[0], kAchromatic), seen(p[1], kRedGreen), seen(p[2], kBlueYellow)};
  };
  const Planes seen_a = filter(a), seen_b = filter(b);
  const Features features_a = features_of(a[0]), features_b = features_of(b[0]);
  double sum = 0;
  for (std::size_t i = 0; i < a[0].data.size(); ++i) {
    const double colour = redistribute(colour_distance(seen_colour(seen_a, i), seen_colour(seen_b, i)));
    const double largest = std::max(std::abs(features_a.edges.data[i] - features_b.edges.data[i]),
                                    std::abs(features_a.points.data[i] - features_b.points.data[i]));
    const double feature = std::pow(largest / std::numbers::sqrt2, kFeatureExponent);
    sum += std::pow(colour, 1.0 - feature);  // eq. 1
  }
  return sum / static_cast<double>(a[0].data.size());
}

}  // namespace lumigraft::server
