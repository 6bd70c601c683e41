#include "tests/bench/comparators/composition.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/camera/srgb.h"

namespace lumigraft::comparators {
namespace {

constexpr int kRaysAlong = 4;  // per pixel edge

}  // namespace

std::optional<Eigen::Vector3f> ray_through(const relight::PosedCamera& camera, double u, double v) {
  const auto w = camera.model.unproject({u, v});
  if (!w) return std::nullopt;
  return (camera.T_tag_camera.linear() * w->cast<float>()).normalized();
}

capture::Image<float> object_coverage(const relight::TraceWorld& world, const relight::PosedCamera& camera) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  const Eigen::Vector3f from = camera.T_tag_camera.translation();
  capture::Image<float> coverage(camera.model.width, camera.model.height, 1);
  for (int v = 0; v < coverage.height; ++v) {
    for (int u = 0; u < coverage.width; ++u) {
      for (int i = 0; i < kRaysAlong * kRaysAlong; ++i) {
        const double du = (i % kRaysAlong + 0.5) / kRaysAlong - 0.5, dv = (i / kRaysAlong + 0.5) / kRaysAlong - 0.5;
        const auto w = ray_through(camera, u + du, v + dv);
        if (!w) continue;
        const auto object = world.objects.hit(from, *w, kFar);
        if (object && !world.real.blocked(from, *w, object->t_m)) {
          coverage.at(u, v) += 1.0f / (kRaysAlong * kRaysAlong);
        }
      }
    }
  }
  return coverage;
}

capture::Image<float> difference(const capture::Image<float>& with, const capture::Image<float>& without,
                                 const capture::Image<float>& coverage) {
  capture::Image<float> added = with;
  for (std::size_t i = 0; i < added.data.size(); ++i) {
    added.data[i] -= (1 - coverage.data[i / 3]) * without.data[i];
  }
  return added;
}

capture::Image<std::uint8_t> composed(const capture::Image<std::uint8_t>& camera_srgb,
                                      const capture::Image<float>& added, const capture::Image<float>& coverage,
                                      float exposure) {
  capture::Image<std::uint8_t> picture = camera_srgb;
  for (std::size_t i = 0; i < picture.data.size(); ++i) {
    const float covered = coverage.data[i / 3];
    if (covered == 0 && added.data[i] == 0) continue;
    const float camera = capture::srgb_to_linear(static_cast<float>(camera_srgb.data[i]) / 255);
    const float light = (1 - covered) * camera + exposure * added.data[i];
    picture.data[i] = static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(std::max(light, 0.0f))));
  }
  return picture;
}

}  // namespace lumigraft::comparators
