#include "relight/compose/composer.h"

#include <algorithm>

#include "capture/camera/srgb.h"
#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {
namespace {

Rgb finite_or_zero(const float* of_pixel) {
  const Rgb light(of_pixel[0], of_pixel[1], of_pixel[2]);
  if (!light.allFinite()) [[unlikely]]
    return Rgb::Zero();
  return light;
}

/// Between frames radiance changes by noise, by more only if light does, which the change of light then follows.
Rgb now_over(const Rgb& now, const float* then) {
  const Rgb before(then[0], then[1], then[2]);
  return (before > 0).select((now / before.max(1e-6f)).min(kCompose.max_flicker).max(1 / kCompose.max_flicker), 1.0f);
}

}  // namespace

void compose(const CameraUpload& camera, const RoomChange& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture) {
  const capture::SrgbTable& srgb = capture::srgb_table();
  for_each_index(picture->height, kRows, [&](int v) {
    std::size_t pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(picture->width);
    const int y = v - objects.top, width = picture->width;
    const bool in_rows = y >= 0 && y < objects.coverage.height;
    for (int u = 0; u < width; ++u, ++pixel) {
      const int x = u - objects.left;
      const float coverage = in_rows && x >= 0 && x < objects.coverage.width ? objects.coverage.at(x, y) : 0;
      Rgb delta = finite_or_zero(&change.delta.data[3 * pixel]);
      if (coverage == 0 && delta.isZero(0)) continue;
      Rgb light = camera.radiance(pixel);
      if (change.radiance) {
        const float* then = &change.radiance->data[3 * pixel];
        for (std::size_t c = 0; c < 3; ++c) {
          if (camera.clipped(pixel, c)) light[c] = std::max(light[c], then[c]);
        }
        if (change.proportional) delta *= now_over(light, then);
      }
      light = (light + delta).max(0);
      if (coverage != 0) {
        const Rgb object = finite_or_zero(&objects.radiance.at(x, y));
        for (int c = 0; c < 3; ++c) light[c] = std::max(composed(light[c], object[c], coverage), 0.0f);
      }
      light *= camera.exposure() * camera.transmission(pixel);
      std::uint8_t* codes = &picture->data[3 * pixel];
      for (int c = 0; c < 3; ++c) codes[c] = srgb.code(light[c]);
    }
  });
}

}  // namespace lumigraft::relight
