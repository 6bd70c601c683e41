#include "relight/tracing/composer.h"

#include "capture/camera/srgb.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {
namespace {

using Pixel = Eigen::Map<const Rgb>;

Rgb finite_or_zero(const Pixel& light) { return light.allFinite() ? Rgb(light) : Rgb(Rgb::Zero()); }

}  // namespace

void compose(const CameraUpload& camera, const capture::Image<float>& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture) {
  const capture::SrgbTable& srgb = capture::srgb_table();
  for_each_block(picture->height, kRows, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      for (int u = 0; u < picture->width; ++u) {
        const std::size_t i = picture->index(u, v);
        const int x = u - objects.left, y = v - objects.top;
        float coverage = 0;
        Rgb object = Rgb::Zero();
        if (x >= 0 && y >= 0 && x < objects.coverage.width && y < objects.coverage.height) {
          coverage = objects.coverage.at(x, y);
          object = finite_or_zero(Pixel(&objects.radiance.at(x, y))).max(0);
        }
        const Pixel delta(&change.data[i]);
        if (coverage == 0 && delta.isZero(0)) continue;
        const Rgb room = (camera.radiance(i / 3) + finite_or_zero(delta)).max(0);
        for (Eigen::Index c = 0; c < 3; ++c) {
          picture->data[i + static_cast<std::size_t>(c)] =
              srgb.code(camera.exposure()[c] * composed(room[c], object[c], coverage));
        }
      }
    }
  });
}

}  // namespace lumigraft::relight
