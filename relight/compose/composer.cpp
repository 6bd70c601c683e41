#include "relight/compose/composer.h"

#include <algorithm>

#include "capture/camera/srgb.h"
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

}  // namespace

void compose(const CameraUpload& camera, const capture::Image<float>& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture) {
  const capture::SrgbTable& srgb = capture::srgb_table();
  for_each_index(picture->height, kRows, [&](int v) {
    std::size_t pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(picture->width);
    const int y = v - objects.top, width = picture->width;
    const bool in_rows = y >= 0 && y < objects.coverage.height;
    for (int u = 0; u < width; ++u, ++pixel) {
      const int x = u - objects.left;
      const float coverage = in_rows && x >= 0 && x < objects.coverage.width ? objects.coverage.at(x, y) : 0;
      const Rgb delta = finite_or_zero(&change.data[3 * pixel]);
      if (coverage == 0 && delta.isZero(0)) continue;
      Rgb light = (camera.radiance(pixel) + delta).max(0);
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
