#include "relight/exhibit/sheen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lumigraft::relight {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Estevez & Kulla 2017, table 1: of alpha 0 and of alpha 1, interpolated by (1 - alpha)².
struct MaskingFit {
  float a, b, c, d, e;

  explicit MaskingFit(float alpha) {
    const float t = (1 - alpha) * (1 - alpha);
    a = std::lerp(21.5473f, 25.3245f, t);
    b = std::lerp(3.82987f, 3.32435f, t);
    c = std::lerp(0.19823f, 0.16801f, t);
    d = std::lerp(-1.97760f, -1.27393f, t);
    e = std::lerp(-4.32054f, -4.85967f, t);
  }

  float exponent(float x) const { return a / (1 + b * std::pow(x, c)) + d * x + e; }
  float lambda(float cosine) const {
    return std::exp(cosine < 0.5f ? exponent(cosine) : 2 * exponent(0.5f) - exponent(1 - cosine));
  }
};

float distribution(float alpha, float cos_half) {
  const float sin2 = std::max(1 - cos_half * cos_half, 0.0f), inverse = 1 / alpha;
  return (2 + inverse) * std::pow(sin2, 0.5f * inverse) / (2 * kPi);
}

/// Over cosines, densely at grazing angles, and roughnesses, the square roots of alpha.
class AlbedoTable {
 public:
  AlbedoTable() {
    for (int r = 0; r < kRoughnesses; ++r) {
      const float roughness = std::lerp(std::sqrt(kMinSheenAlpha), 1.0f, static_cast<float>(r) / (kRoughnesses - 1));
      for (int i = 0; i < kCosines; ++i)
        albedo_[static_cast<std::size_t>(r)][static_cast<std::size_t>(i)] =
            integrated(roughness * roughness, cosine_of(i));
      integrate(r);
    }
  }

  float albedo(float alpha, float cosine) const { return at(albedo_, alpha, cosine); }
  float larger(float alpha, float cosine) const { return at(larger_, alpha, cosine); }
  float albedo_evenly(float alpha) const { return along(albedo_evenly_, alpha); }
  float larger_evenly(float alpha) const { return along(larger_evenly_, alpha); }

 private:
  static constexpr int kCosines = 24, kRoughnesses = 24, kRings = 48, kAround = 32, kSteps = 256;
  static constexpr float kMinCosine = 1e-3f;
  using Table = std::array<std::array<float, kCosines>, kRoughnesses>;
  using Line = std::array<float, kRoughnesses>;

  static float cosine_of(int i) {
    const float s = static_cast<float>(i) / (kCosines - 1);
    return std::max(s * s, kMinCosine);
  }

  /// Midpoints in the square root of the cosine of w and in its azimuth, which by symmetry covers half a turn.
  static float integrated(float alpha, float cos_v) {
    const float sin_v = std::sqrt(std::max(1 - cos_v * cos_v, 0.0f));
    float sum = 0;
    for (int ring = 0; ring < kRings; ++ring) {
      const float s = (static_cast<float>(ring) + 0.5f) / kRings, cos_w = s * s;
      const float sin_w = std::sqrt(1 - cos_w * cos_w), weight = 2 * s / kRings * cos_w;
      for (int k = 0; k < kAround; ++k) {
        const float phi = kPi * (static_cast<float>(k) + 0.5f) / kAround;
        const float length2 = 2 + 2 * (cos_v * cos_w + sin_v * sin_w * std::cos(phi));
        const float cos_half = (cos_v + cos_w) / std::sqrt(std::max(length2, 1e-12f));
        sum += weight * (2 * kPi / kAround) * sheen_brdf(alpha, cos_v, cos_w, std::min(cos_half, 1.0f));
      }
    }
    return std::min(sum, 1.0f);
  }

  void integrate(int r) {
    const auto index = static_cast<std::size_t>(r);
    const auto row = [&](float cosine) { return between(albedo_[index], cosine); };
    const auto mean = [](const auto& value) {
      float sum = 0;
      for (int k = 0; k < kSteps; ++k) {
        const float c = (static_cast<float>(k) + 0.5f) / kSteps;
        sum += 2 * c * value(c) / kSteps;
      }
      return sum;
    };
    for (int i = 0; i < kCosines; ++i) {
      const float own = albedo_[index][static_cast<std::size_t>(i)];
      larger_[index][static_cast<std::size_t>(i)] = mean([&](float c) { return std::max(own, row(c)); });
    }
    albedo_evenly_[index] = mean(row);
    larger_evenly_[index] = mean([&](float c) { return between(larger_[index], c); });
  }

  static float between(const std::array<float, kCosines>& row, float cosine) {
    const float at = std::sqrt(std::clamp(cosine, 0.0f, 1.0f)) * (kCosines - 1);
    const int i = std::min(static_cast<int>(at), kCosines - 2);
    return std::lerp(row[static_cast<std::size_t>(i)], row[static_cast<std::size_t>(i) + 1],
                     at - static_cast<float>(i));
  }
  static float row_of(float alpha) {
    const float min = std::sqrt(kMinSheenAlpha), roughness = std::sqrt(std::clamp(alpha, kMinSheenAlpha, 1.0f));
    return (roughness - min) / (1 - min) * (kRoughnesses - 1);
  }
  static float at(const Table& table, float alpha, float cosine) {
    const float row = row_of(alpha);
    const int r = std::min(static_cast<int>(row), kRoughnesses - 2);
    return std::lerp(between(table[static_cast<std::size_t>(r)], cosine),
                     between(table[static_cast<std::size_t>(r) + 1], cosine), row - static_cast<float>(r));
  }
  static float along(const Line& line, float alpha) {
    const float row = row_of(alpha);
    const int r = std::min(static_cast<int>(row), kRoughnesses - 2);
    return std::lerp(line[static_cast<std::size_t>(r)], line[static_cast<std::size_t>(r) + 1],
                     row - static_cast<float>(r));
  }

  Table albedo_{}, larger_{};
  Line albedo_evenly_{}, larger_evenly_{};
};

const AlbedoTable& albedo_table() {
  static const AlbedoTable table;
  return table;
}

}  // namespace

float sheen_brdf(float alpha, float cos_v, float cos_w, float cos_half) {
  const MaskingFit fit(alpha);
  const float masking = 1 / (1 + fit.lambda(cos_v) + fit.lambda(cos_w));
  return distribution(alpha, cos_half) * masking / (4 * cos_v * cos_w);
}

float sheen_albedo(float alpha, float cos_v) { return albedo_table().albedo(alpha, cos_v); }
float sheen_albedo_evenly(float alpha) { return albedo_table().albedo_evenly(alpha); }
float larger_sheen_albedo(float alpha, float cos_v) { return albedo_table().larger(alpha, cos_v); }
float larger_sheen_albedo_evenly(float alpha) { return albedo_table().larger_evenly(alpha); }

}  // namespace lumigraft::relight
