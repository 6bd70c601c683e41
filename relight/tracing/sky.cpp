#include "relight/tracing/sky.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "relight/tracing/bsdf.h"

namespace lumigraft::relight {
namespace {

float polar_cosine(int y, int height) { return std::cos(kPi * static_cast<float>(y) / static_cast<float>(height)); }

/// First entry above u times the last, and the position of u between it and the previous.
std::size_t pick(const double* sums, std::size_t count, float u, float& within) {
  const double at = u * sums[count - 1];
  const std::size_t i = std::min<std::size_t>(std::upper_bound(sums, sums + count, at) - sums, count - 1);
  const double low = i == 0 ? 0 : sums[i - 1], span = sums[i] - low;
  within = span > 0 ? std::clamp(static_cast<float>((at - low) / span), 0.0f, 1.0f - 0x1p-24f) : 0.5f;
  return i;
}

}  // namespace

Sky::Sky(const ReferenceScene& scene) : scene_(scene) {
  const capture::Image<float>& picture = scene.environment.radiance;
  if (picture.empty()) return;
  width_ = picture.width;
  height_ = picture.height;
  // Radiance is bilinear between texels: a texel's upper bound is the maximum of its neighbourhood.
  const auto luminance_of = [&](int x, int y) {
    float largest = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int u = (x + dx + width_) % width_, v = std::clamp(y + dy, 0, height_ - 1);
        largest = std::max(largest, luminance({picture.at(u, v, 0), picture.at(u, v, 1), picture.at(u, v, 2)}));
      }
    }
    return largest;
  };
  for (int y = 0; y < height_; ++y) {
    double row = 0;
    for (int x = 0; x < width_; ++x) {
      weights_.push_back(std::max(luminance_of(x, y), 0.0f) * texel_sr(y));
      columns_.push_back(row += weights_.back());
    }
    rows_.push_back(total_ += row);
  }
}

float Sky::texel_sr(int y) const {
  return 2 * kPi / static_cast<float>(width_) * (polar_cosine(y, height_) - polar_cosine(y + 1, height_));
}

Rgb Sky::radiance(const Eigen::Vector3f& w) const {
  if (scene_.environment.radiance.empty()) return scene_.background;
  return scene_.environment.sample(w).array();
}

LightSample Sky::sample(const Eigen::Vector2f& u) const {
  if (!is_picture()) return {};
  float in_x = 0, in_y = 0;
  const auto y = static_cast<int>(pick(rows_.data(), rows_.size(), u.y(), in_y));
  const auto width = static_cast<std::size_t>(width_);
  const auto x = static_cast<int>(pick(columns_.data() + static_cast<std::size_t>(y) * width, width, u.x(), in_x));
  const float phi = 2 * kPi * (static_cast<float>(x) + in_x) / static_cast<float>(width_) - kPi;
  const float top = polar_cosine(y, height_), z = top + in_y * (polar_cosine(y + 1, height_) - top);
  const float s = std::sqrt(std::max(1 - z * z, 0.0f));
  LightSample sample;
  sample.w = Eigen::Vector3f(s * std::cos(phi), s * std::sin(phi), z).normalized();
  sample.distance_m = std::numeric_limits<float>::infinity();
  sample.radiance = radiance(sample.w);
  sample.pdf = static_cast<float>(weight(x, y) / (total_ * texel_sr(y)));
  return sample;
}

float Sky::pdf(const Eigen::Vector3f& w) const {
  if (!is_picture()) return 0;
  const float across = (std::atan2(w.y(), w.x()) + kPi) / (2 * kPi) * static_cast<float>(width_);
  const float down = std::acos(std::clamp(w.z(), -1.0f, 1.0f)) / kPi * static_cast<float>(height_);
  const int x = std::clamp(static_cast<int>(across), 0, width_ - 1);
  const int y = std::clamp(static_cast<int>(down), 0, height_ - 1);
  return static_cast<float>(weight(x, y) / (total_ * texel_sr(y)));
}

}  // namespace lumigraft::relight
