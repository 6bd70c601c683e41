#include "relight/compose/add_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "capture/camera/srgb.h"
#include "reconstruct/math/simd4.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::Simd4;

/// Variance by pixel value in linear light, and the slope that leads back: pixel values per linear value.
struct LinearNoise {
  std::array<std::array<float, 256>, 3> variance;
  std::array<std::array<float, 256>, 3> sigma_codes;  ///< of the pixel value
  std::array<float, 256> slope, inverse;              ///< inverse: of the linear value

  explicit LinearNoise(const NoiseModel& noise) {
    const std::array<float, 256>& linear = capture::srgb_table().linear;
    for (std::size_t code = 0; code < 256; ++code) {
      const std::size_t low = code == 0 ? 0 : code - 1, high = std::min<std::size_t>(code + 1, 255);
      slope[code] = static_cast<float>(high - low) / (linear[high] - linear[low]);
      inverse[code] = 1 / std::max(linear[code], linear[1]);
      for (std::size_t c = 0; c < 3; ++c) {
        variance[c][code] = noise.variance[c][code] / (slope[code] * slope[code]);
        sigma_codes[c][code] = std::sqrt(std::max(noise.variance[c][code], 0.0f));
      }
    }
  }
};

/// How many of the first `count` values are equal, in whole words at least.
int equal_values(const std::uint8_t* a, const std::uint8_t* b, int count) {
  constexpr int kWord = 8;
  int equal = 0;
  for (; equal + kWord <= count; equal += kWord) {
    std::uint64_t of_a = 0, of_b = 0;
    std::memcpy(&of_a, a + equal, kWord);
    std::memcpy(&of_b, b + equal, kWord);
    if (of_a != of_b) break;
  }
  return equal;
}

/// Of each channel's pixel value.
Simd4 looked_up(const std::array<float, 256>& table, const std::uint8_t* codes) {
  return Simd4{table[codes[0]], table[codes[1]], table[codes[2]], 0};
}
Simd4 looked_up(const std::array<std::array<float, 256>, 3>& tables, const std::uint8_t* codes) {
  return Simd4{tables[0][codes[0]], tables[1][codes[1]], tables[2][codes[2]], 0};
}

}  // namespace

void add_noise(const NoiseModel& noise, const capture::Image<std::uint8_t>& camera, const ObjectLayer& objects,
               std::uint64_t seed, capture::Image<std::uint8_t>* picture) {
  const LinearNoise of(noise);
  const std::array<float, 256>& linear = capture::srgb_table().linear;
  std::mt19937_64 random(seed);
  const std::uint64_t shift = random();
  const int du = static_cast<int>(shift % NoiseTile::kEdge), dv = static_cast<int>((shift >> 32) % NoiseTile::kEdge);
  for_each_index(picture->height, kRows, [&](int v) {
    const int y = v - objects.top, width = picture->width;
    const bool in_rows = y >= 0 && y < objects.coverage.height;
    const int left = in_rows ? objects.left : width, right = in_rows ? left + objects.coverage.width : width;
    for (int u = 0; u < width; ++u) {
      const std::size_t i = picture->index(u, v);
      std::uint8_t* out = &picture->data[i];
      const std::uint8_t* seen = &camera.data[i];
      const bool in_window = u >= left && u < right;
      if (!in_window) {
        // Most of the room does not change.
        const int equal = equal_values(out, seen, 3 * ((u < left ? left : width) - u)) / 3;
        if (equal > 0) {
          u += equal - 1;
          continue;
        }
      }
      const float covered = in_window ? objects.coverage.at(u - left, y) : 0;
      if (covered == 0 && out[0] == seen[0] && out[1] == seen[1] && out[2] == seen[2]) continue;
      Simd4 sigma;
      if (covered >= 1) {
        sigma = looked_up(of.sigma_codes, out);
      } else {  // the picture's own noise remains in part
        const Simd4 factor =
            covered > 0 ? reconstruct::broadcast(1 - covered) : looked_up(linear, out) * looked_up(of.inverse, seen);
        const Simd4 missing = looked_up(of.variance, out) - factor * factor * looked_up(of.variance, seen);
        if (!reconstruct::any(missing > 0)) continue;
        sigma = looked_up(of.slope, out) * reconstruct::sqrt(reconstruct::max(missing, Simd4{}));
      }
      const float* sample = noise.tile->at(u + du, v + dv);
      const Simd4 added = sigma * Simd4{sample[0], sample[1], sample[2], 0};
      const reconstruct::Simd4Int codes{out[0], out[1], out[2], 0};
      const Simd4 sum = __builtin_convertvector(codes, Simd4) + added + reconstruct::broadcast(0.5f);
      const auto noisy = __builtin_convertvector(
          reconstruct::max(reconstruct::min(sum, reconstruct::broadcast(255)), Simd4{}), reconstruct::Simd4Int);
      for (int c = 0; c < 3; ++c) out[c] = static_cast<std::uint8_t>(noisy[c]);
    }
  });
}

}  // namespace lumigraft::relight
