#include "relight/gather/hole_fill.h"

#include <array>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

bool is_hole(const GBufferPixel& p) { return !p.known || (!p.glossy && p.albedo.maxCoeff() <= 0); }

Rgb coded(const Rgb& light, const Rgb& exposure) {
  return {capture::linear_to_srgb(exposure[0] * light[0]), capture::linear_to_srgb(exposure[1] * light[1]),
          capture::linear_to_srgb(exposure[2] * light[2])};
}

}  // namespace

void fill_holes(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure,
                std::vector<GBufferPixel>& seen) {
  constexpr std::array<std::array<int, 2>, 8> ways = {
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};
  const int width = camera.model.width, height = camera.model.height;
  const float reach = kGather.hole_reach * static_cast<float>(width);
  const auto usable = [&](int u, int v) {
    if (u < 0 || v < 0 || u >= width || v >= height) return false;
    const GBufferPixel& p = seen[static_cast<std::size_t>(v * width + u)];
    return !is_hole(p) && !p.glossy;
  };
  replace_pixels(seen, width, height, [&](int u, int v) -> std::optional<GBufferPixel> {
    const GBufferPixel& hole = seen[static_cast<std::size_t>(v * width + u)];
    if (!is_hole(hole) || hole.w.isZero(0)) return std::nullopt;
    const Rgb own = radiance_at(radiance, static_cast<std::size_t>(v * width + u)), own_code = coded(own, exposure);
    float min_unlike = kGather.hole_color;
    int best = -1;
    for (const auto& [x, y] : ways) {
      for (int s = 1; s <= static_cast<int>(reach); ++s) {
        if (!usable(u + s * x, v + s * y)) continue;
        // Fused surfaces are rounded at their ends; slightly farther inside they are flat.
        const int in = usable(u + (s + 2) * x, v + (s + 2) * y) ? s + 2 : s;
        const int at = (v + in * y) * width + u + in * x;
        const Rgb code = coded(radiance_at(radiance, static_cast<std::size_t>(at)), exposure);
        const float unlike =
            std::sqrt((code - own_code).square().sum()) + kGather.hole_near_color * static_cast<float>(s) / reach;
        if (unlike < min_unlike) {
          min_unlike = unlike;
          best = at;
        }
        break;
      }
    }
    if (best < 0) return std::nullopt;
    const GBufferPixel& similar = seen[static_cast<std::size_t>(best)];
    const Vector3f eye_m = camera.T_tag_camera.translation(), &n = similar.surface.normal;
    const float fall = n.dot(hole.w), t = n.dot(similar.surface.position_m - eye_m) / fall;
    if (fall > -kGather.grazing || !(std::abs(t - similar.depth_m) < 0.5f * similar.depth_m)) return std::nullopt;
    GBufferPixel p = similar;
    p.w = hole.w;
    p.depth_m = t;
    p.surface.position_m = eye_m + t * hole.w;
    p.surface.face = n;
    p.albedo = detailed(similar.albedo, own, radiance_at(radiance, static_cast<std::size_t>(best)));
    return p;
  });
}

}  // namespace lumigraft::relight
