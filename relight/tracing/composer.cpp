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
  for_each_pixel(picture->width, picture->height, kRows, [&](int u, int v) {
    const std::size_t i = picture->index(u, v);
    const int x = u - objects.left, y = v - objects.top;
    float coverage = 0;
    Rgb object = Rgb::Zero();
    if (x >= 0 && y >= 0 && x < objects.coverage.width && y < objects.coverage.height) {
      coverage = objects.coverage.at(x, y);
      object = finite_or_zero(Pixel(&objects.radiance.at(x, y))).max(0);
    }
    const Pixel delta(&change.data[i]);
    if (coverage == 0 && delta.isZero(0)) return;
    const Rgb room = (camera.radiance(i / 3) + finite_or_zero(delta)).max(0);
    const Rgb exposure = camera.transmission(i / 3) * camera.exposure();
    for (int c = 0; c < 3; ++c) picture->at(u, v, c) = srgb.code(exposure[c] * composed(room[c], object[c], coverage));
  });
}

}  // namespace lumigraft::relight
