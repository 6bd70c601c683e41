#include "relight/compose/composer.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "capture/camera/srgb.h"
#include "reconstruct/math/simd4.h"
#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::broadcast;
using reconstruct::Simd4;

/// The three channels of a pixel, and 0.
template <typename Channels>
Simd4 channels_of(const Channels& of_pixel) {
  return Simd4{of_pixel[0], of_pixel[1], of_pixel[2], 0};
}

Simd4 finite_or_zero(Simd4 light) {
  const bool finite = !reconstruct::any(light - light != Simd4{});
  return finite ? light : Simd4{};
}

/// Between frames radiance changes by noise, by more only if light does, which the change of light then follows.
Simd4 now_over(Simd4 now, Simd4 before) {
  const Simd4 ratio = now / reconstruct::max(before, broadcast(1e-6f));
  const Simd4 bounded =
      reconstruct::max(reconstruct::min(ratio, broadcast(kCompose.max_flicker)), broadcast(1 / kCompose.max_flicker));
  return reconstruct::select(before > 0, bounded, broadcast(1));
}

/// By pixel value, the change of linear light that surely does not change it.
struct Unchanged {
  std::array<float, 256> linear;

  Unchanged() {
    constexpr float kHalf = 0.49f;  // of a pixel value; the rest is for rounding
    for (std::size_t code = 0; code < linear.size(); ++code) {
      const auto value = static_cast<float>(code);
      const auto light = [&](float encoded) { return capture::srgb_to_linear(std::max(encoded, 0.0f) / 255); };
      const float own = light(value);
      linear[code] = code == 0 ? light(kHalf) : std::min(own - light(value - kHalf), light(value + kHalf) - own);
    }
  }
  /// Whether a pixel with these values keeps them. `change`: of linear light.
  bool holds(const std::uint8_t* codes, Simd4 change) const {
    const Simd4 bound{linear[codes[0]], linear[codes[1]], linear[codes[2]], 1};
    return !reconstruct::any(reconstruct::abs(change) >= bound);
  }
};

}  // namespace

void compose(const CameraUpload& camera, const RoomChange& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture) {
  const capture::SrgbTable& srgb = capture::srgb_table();
  static const Unchanged unchanged;
  const Simd4 exposure = channels_of(camera.exposure());
  for_each_index(picture->height, kRows, [&](int v) {
    std::size_t pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(picture->width);
    const int y = v - objects.top, width = picture->width;
    const bool in_rows = y >= 0 && y < objects.coverage.height;
    for (int u = 0; u < width; ++u, ++pixel) {
      const int x = u - objects.left;
      const float coverage = in_rows && x >= 0 && x < objects.coverage.width ? objects.coverage.at(x, y) : 0;
      Simd4 delta = finite_or_zero(channels_of(&change.delta.data[3 * pixel]));
      if (coverage == 0 && !reconstruct::any(delta != Simd4{})) continue;
      Simd4 light = channels_of(camera.radiance(pixel));
      if (change.radiance) {
        const Simd4 then = channels_of(&change.radiance->data[3 * pixel]);
        if (camera.clipped(pixel)) {
          const auto clipped = [&](std::size_t channel) { return camera.clipped(pixel, channel) ? -1 : 0; };
          const reconstruct::Simd4Int clips{clipped(0), clipped(1), clipped(2), 0};
          light = reconstruct::select(clips, reconstruct::max(light, then), light);
        }
        if (change.proportional) delta *= now_over(light, then);
      }
      std::uint8_t* codes = &picture->data[3 * pixel];
      const Simd4 transmitted = exposure * broadcast(camera.transmission(pixel));
      // Most of the room changes by less than a pixel value.
      if (coverage == 0 && camera.coded_exactly(pixel) && unchanged.holds(codes, transmitted * delta)) continue;
      light = reconstruct::max(light + delta, Simd4{});
      if (coverage != 0) {
        const Simd4 object = finite_or_zero(channels_of(&objects.radiance.at(x, y)));
        light = reconstruct::max(composed(light, object, broadcast(coverage)), Simd4{});
      }
      light *= transmitted;
      codes[0] = srgb.code(light[0]);
      codes[1] = srgb.code(light[1]);
      codes[2] = srgb.code(light[2]);
    }
  });
}

}  // namespace lumigraft::relight
