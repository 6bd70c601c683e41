#include "relight/gather/hole_fill.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr float kReach = 0.04f;                     // search radius, fraction of the image width
constexpr float kUnlikeColor = 0.15f;               // in coded colour from 0 to 1: a larger difference means another
                                                    // surface
constexpr float kNearerColor = 0.1f;                // colour difference that counts as much as the search radius
constexpr float kMinDetail = 0.2f, kMaxDetail = 4;  // of a pixel's radiance over the neighbouring one's
constexpr float kMinCosine = 0.05f;                 // of a plane viewed from the camera

struct Filled {
  int pixel;
  GBufferPixel surface;
};

bool is_hole(const GBufferPixel& p) { return !p.known || (!p.glossy && p.albedo.maxCoeff() <= 0); }

Rgb pixel(const capture::Image<float>& image, int i) {
  const float* at = &image.data[3 * static_cast<std::size_t>(i)];
  return {at[0], at[1], at[2]};
}

Rgb coded(const Rgb& light, float exposure) {
  return {capture::linear_to_srgb(exposure * light[0]), capture::linear_to_srgb(exposure * light[1]),
          capture::linear_to_srgb(exposure * light[2])};
}

}  // namespace

void fill_holes(const PosedCamera& camera, const capture::Image<float>& radiance, float exposure,
                std::vector<GBufferPixel>& seen) {
  constexpr std::array<std::array<int, 2>, 8> ways = {
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};
  const int width = camera.model.width, height = camera.model.height;
  const float reach = kReach * static_cast<float>(width);
  std::vector<std::vector<Filled>> filled(
      static_cast<std::size_t>(height));  // by row; values are replaced only after all have been searched
  const auto usable = [&](int u, int v) {
    if (u < 0 || v < 0 || u >= width || v >= height) return false;
    const GBufferPixel& p = seen[static_cast<std::size_t>(v * width + u)];
    return !is_hole(p) && !p.glossy;
  };
  for_each_block(height, 4, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      for (int u = 0; u < width; ++u) {
        const GBufferPixel& hole = seen[static_cast<std::size_t>(v * width + u)];
        if (!is_hole(hole) || hole.w.isZero(0)) continue;
        const Rgb own = pixel(radiance, v * width + u), own_code = coded(own, exposure);
        float min_unlike = kUnlikeColor;
        int best = -1;
        for (const auto& [x, y] : ways) {
          for (int s = 1; s <= static_cast<int>(reach); ++s) {
            if (!usable(u + s * x, v + s * y)) continue;
            // Fused surfaces are rounded at their ends; slightly farther inside they are flat.
            const int in = usable(u + (s + 2) * x, v + (s + 2) * y) ? s + 2 : s;
            const int at = (v + in * y) * width + u + in * x;
            const float unlike = std::sqrt((coded(pixel(radiance, at), exposure) - own_code).square().sum()) +
                                 kNearerColor * static_cast<float>(s) / reach;
            if (unlike < min_unlike) {
              min_unlike = unlike;
              best = at;
            }
            break;
          }
        }
        if (best < 0) continue;
        const GBufferPixel& similar = seen[static_cast<std::size_t>(best)];
        const Vector3f eye_m = camera.T_tag_camera.translation(), &n = similar.surface.normal;
        const float fall = n.dot(hole.w), t = n.dot(similar.surface.position_m - eye_m) / fall;
        if (fall > -kMinCosine || !(std::abs(t - similar.depth_m) < 0.5f * similar.depth_m)) continue;
        Filled& now = filled[static_cast<std::size_t>(v)].emplace_back(Filled{v * width + u, similar});
        GBufferPixel& p = now.surface;
        p.w = hole.w;
        p.depth_m = t;
        p.surface.position_m = eye_m + t * hole.w;
        p.surface.face = n;
        const Rgb detail = (own / pixel(radiance, best).max(1e-5f)).max(kMinDetail).min(kMaxDetail);
        p.albedo = (similar.albedo * detail).min(1.0f);
      }
    }
  });
  for (const std::vector<Filled>& row : filled) {
    for (const Filled& f : row) seen[static_cast<std::size_t>(f.pixel)] = f.surface;
  }
}

}  // namespace lumigraft::relight
