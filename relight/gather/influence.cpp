#include "relight/gather/influence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "capture/camera/srgb.h"
#include "relight/gather/object_window.h"
#include "relight/gather/parameters.h"
#include "relight/gather/ray_shadows.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Codes = std::array<std::uint8_t, 3>;

/// The largest codes of a tile: there a change of light by the same factor is the most codes.
Codes brightest(const capture::Image<std::uint8_t>& codes, int x, int y) {
  Codes most{};
  for (int v = y * TileMask::kEdge; v < std::min((y + 1) * TileMask::kEdge, codes.height); ++v) {
    for (int u = x * TileMask::kEdge; u < std::min((x + 1) * TileMask::kEdge, codes.width); ++u) {
      const std::uint8_t* pixel = &codes.data[codes.index(u, v)];
      for (std::size_t c = 0; c < 3; ++c) most[c] = std::max(most[c], pixel[c]);
    }
  }
  return most;
}

/// Codes by which a picture of these darkens if it loses a part of its light; it brightens by less.
float lost_codes(std::uint8_t code, float part) {
  const float light = capture::srgb_table().linear[code];
  return static_cast<float>(code) - 255 * capture::linear_to_srgb(light * std::max(1 - part, 0.0f));
}

/// Parts of the light of a pixel's surface that the objects change, without regard to signs.
Rgb changed_part(const GBufferPixel& pixel, const Rgb& irradiance) {
  return irradiance * pixel.surface.bsdf.diffuse / (kPi * pixel.before.max(std::numeric_limits<float>::min()));
}

/// Whether what is inside of a sphere may shade a tile from a light source: the sphere touches the cone between them.
bool may_shade(const Eigen::Vector4f& sphere, const Eigen::Vector3f& tile_m, float radius_m,
               const LightSource& source) {
  const Eigen::Vector3f way = source.centre_m() - tile_m, to = sphere.head<3>() - tile_m;
  const float along = std::clamp(to.dot(way) / way.squaredNorm(), 0.0f, 1.0f);
  return (to - along * way).norm() <= sphere.w() + (1 - along) * radius_m + along * source.reach_m();
}

/// Upper bound of the light of lamps that objects hide at any point of a tile. Shadows may be narrower than a tile, so
/// the shadow at its one traced pixel is no bound.
Rgb hidden_at_most(const std::vector<Eigen::Vector4f>& spheres, const std::vector<LightSampleSet>& lamps,
                   const GBufferPixel& pixel, float radius_m) {
  Rgb sum = Rgb::Zero();
  for (const LightSampleSet& lamp : lamps) {
    const bool shaded = std::ranges::any_of(spheres, [&](const Eigen::Vector4f& sphere) {
      return may_shade(sphere, pixel.surface.position_m, radius_m, lamp);
    });
    if (shaded) sum += lamp.irradiance(pixel.surface);
  }
  return sum;
}

TileMask with_neighbours(const TileMask& tiles, int width, int height) {
  TileMask wider(width, height, false);
  for (int y = 0; y < tiles.down(); ++y) {
    for (int x = 0; x < tiles.across(); ++x) {
      if (!tiles.tile(x, y)) continue;
      for (int j = std::max(y - 1, 0); j <= std::min(y + 1, tiles.down() - 1); ++j) {
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, tiles.across() - 1); ++i) wider.set(i, j);
      }
    }
  }
  return wider;
}

/// Adds tiles without fused surface of whose neighbours in reach one is in the mask.
void add_holes(const TilePixels& pixels, int reach, TileMask& tiles) {
  const TileMask before = tiles;
  for (int y = 0; y < tiles.down(); ++y) {
    for (int x = 0; x < tiles.across(); ++x) {
      const GBufferPixel& p = pixels.seen[static_cast<std::size_t>(y * tiles.across() + x)];
      if (before.tile(x, y) || (p.known && !p.modelled)) continue;
      for (int j = std::max(y - reach, 0); j <= std::min(y + reach, tiles.down() - 1); ++j) {
        for (int i = std::max(x - reach, 0); i <= std::min(x + reach, tiles.across() - 1); ++i) {
          if (before.tile(i, j)) tiles.set(x, y);
        }
      }
    }
  }
}

}  // namespace

TileMask influenced_tiles(const DeltaLight& light, const IrradianceChangeCache& cells,
                          const std::vector<LightSampleSet>& lamps, const TilePixels& tiles,
                          const capture::Image<std::uint8_t>& codes, const GatherQuality& detail) {
  GatherQuality each = detail;
  each.step = 1;
  each.sparse = false;
  const std::vector<Eigen::Array4f> added =
      lit_by_objects(light, light.objects().emitter_samples(), tiles.seen, tiles.camera, each);
  const std::vector<Eigen::Vector4f>& spheres = light.objects().meshes().spheres();
  std::vector<std::uint8_t> changed(tiles.seen.size());
  for_each_pixel(tiles.camera.width, tiles.camera.height, kRows, [&](int x, int y) {
    const auto i = static_cast<std::size_t>(y * tiles.camera.width + x);
    const GBufferPixel& p = tiles.seen[i];
    if (!p.known) return;
    const SurfaceHit& surface = p.surface;
    const Rgb indirect = cells.at(surface.position_m, surface.face).abs(),
              caustic = light.caustic(surface.position_m, surface.face);
    const float radius_m = p.depth_m / static_cast<float>(tiles.camera.fx);
    const Rgb hidden = hidden_at_most(spheres, lamps, p, radius_m);
    const Rgb part = changed_part(p, hidden + added[i].head<3>() + indirect + caustic);
    bool visible = p.glossy;
    const Codes most = visible ? Codes{} : brightest(codes, x, y);
    for (int c = 0; c < 3 && !visible; ++c)
      visible = !(lost_codes(most[static_cast<std::size_t>(c)], part[c]) < kGather.visible_codes);
    changed[i] = visible;
  });
  TileMask mask(codes.width, codes.height, false);
  for (int y = 0; y < mask.down(); ++y) {
    for (int x = 0; x < mask.across(); ++x) {
      if (changed[static_cast<std::size_t>(y * mask.across() + x)]) mask.set(x, y);
    }
  }
  mask = with_neighbours(mask, codes.width, codes.height);
  const float reach_px = kGather.hole_reach * static_cast<float>(codes.width);
  add_holes(tiles, static_cast<int>(std::ceil(reach_px / TileMask::kEdge)), mask);
  return mask;
}

void add_object_tiles(const std::vector<Eigen::Vector4f>& spheres, const CameraRays& eye, TileMask& tiles) {
  const PixelWindow window = window_of(spheres, eye);
  for (int v = window.top; v < window.top + window.height; v += TileMask::kEdge) {
    for (int u = window.left; u < window.left + window.width; u += TileMask::kEdge)
      tiles.set(u / TileMask::kEdge, v / TileMask::kEdge);
  }
}

}  // namespace lumigraft::relight
