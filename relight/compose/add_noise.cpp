#include "relight/compose/add_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "capture/camera/srgb.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

/// Variance by pixel value in linear light, and the slope that leads back: pixel values per linear value.
struct LinearNoise {
  std::array<std::array<float, 256>, 3> variance;
  std::array<float, 256> slope;

  explicit LinearNoise(const NoiseModel& noise) {
    const std::array<float, 256>& linear = capture::srgb_table().linear;
    for (std::size_t code = 0; code < 256; ++code) {
      const std::size_t low = code == 0 ? 0 : code - 1, high = std::min<std::size_t>(code + 1, 255);
      slope[code] = static_cast<float>(high - low) / (linear[high] - linear[low]);
      for (std::size_t c = 0; c < 3; ++c) variance[c][code] = noise.variance[c][code] / (slope[code] * slope[code]);
    }
  }
};

}  // namespace

void add_noise(const NoiseModel& noise, const capture::Image<std::uint8_t>& camera, const ObjectLayer& objects,
               std::uint64_t seed, capture::Image<std::uint8_t>* picture) {
  const LinearNoise of(noise);
  const std::array<float, 256>& linear = capture::srgb_table().linear;
  std::mt19937_64 random(seed);
  const std::uint64_t shift = random();
  const int du = static_cast<int>(shift % NoiseTile::kEdge), dv = static_cast<int>((shift >> 32) % NoiseTile::kEdge);
  for_each_index(picture->height, kRows, [&](int v) {
    const int y = v - objects.top;
    const bool in_rows = y >= 0 && y < objects.coverage.height;
    for (int u = 0; u < picture->width; ++u) {
      const int x = u - objects.left;
      const float covered = in_rows && x >= 0 && x < objects.coverage.width ? objects.coverage.at(x, y) : 0;
      const std::size_t i = picture->index(u, v);
      std::uint8_t* out = &picture->data[i];
      const std::uint8_t* seen = &camera.data[i];
      if (covered == 0 && std::equal(out, out + 3, seen)) continue;
      const float* sample = noise.tile->at(u + du, v + dv);
      for (std::size_t c = 0; c < 3; ++c) {
        const float factor = covered > 0 ? 1 - covered : linear[out[c]] / std::max(linear[seen[c]], linear[1]);
        const float missing = of.variance[c][out[c]] - factor * factor * of.variance[c][seen[c]];
        if (!(missing > 0)) continue;
        const float code = static_cast<float>(out[c]) + of.slope[out[c]] * std::sqrt(missing) * sample[c];
        out[c] = static_cast<std::uint8_t>(std::clamp(code + 0.5f, 0.0f, 255.0f));
      }
    }
  });
}

}  // namespace lumigraft::relight
