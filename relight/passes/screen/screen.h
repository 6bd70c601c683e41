#pragma once
// The image buffers passed between passes. Linear radiance, W/sr/m², unless noted.
#include <memory>
#include <optional>

#include "relight/gpu/device.h"
#include "relight/passes/screen/tiles.h"

namespace lumigraft::relight {

struct Screen {
  int width = 0, height = 0, scale = 0, shadow_scale = 1, ambient_scale = 1, supersampling = 0;
  int max_lamps = 0;
  /// Pixels along each axis per sample where lamp shadows change: the shadow images are no finer, and for small pixels
  /// neighbours differ by less.
  int fine_step = 1;
  std::unique_ptr<Tiles> tiles;  ///< blocks that passes work on; the outside is cleared
  // Camera input.
  std::unique_ptr<gpu::Texture> rays;   ///< x/z and y/z per pixel
  std::unique_ptr<gpu::Texture> codes;  ///< 8-bit pixel values
  std::unique_ptr<gpu::Texture> radiance;
  std::unique_ptr<gpu::Texture> depth;  ///< metres along z, 0: none
  // Virtual surfaces.
  std::unique_ptr<gpu::Texture> sample_normal, sample_base, sample_depth, sample_emission, sample_z;  ///< supersampled
  std::unique_ptr<gpu::Texture> lit_samples;        ///< radiance; camera z
  std::unique_ptr<gpu::Texture> object_normal;      ///< tag frame; roughness
  std::unique_ptr<gpu::Texture> object_base;        ///< base colour; metallic
  std::unique_ptr<gpu::Texture> object_surface;     ///< z, coverage, specular, share of another surface
  std::unique_ptr<gpu::Texture> object_other;       ///< that surface: normal, tag frame; z
  std::unique_ptr<gpu::Texture> object_emission;    ///< fraction that passes; opaque: pack_coat (clearcoat.glsl)
  std::unique_ptr<gpu::Texture> object_irradiance;  ///< without lamps, at 1/ambient_scale
  std::unique_ptr<gpu::Texture> object_mirrored;    ///< radiance of the specular part without lamps, at 1/ambient_scale
  std::unique_ptr<gpu::Texture> object_open;        ///< visible fraction of lamps 0-3; below it of 4-7, ...
  std::unique_ptr<gpu::Texture> object_radiance;
  // Known materials of real surfaces in the camera view.
  std::unique_ptr<gpu::Texture> known_normal, known_base, known_depth, known_z;
  // Real surfaces.
  std::unique_ptr<gpu::Texture> real_position;  ///< tag frame; z, 0: unknown
  std::unique_ptr<gpu::Texture> real_normal;    ///< tag frame; value of the influence mask
  std::unique_ptr<gpu::Texture> real_albedo;    ///< diffuse; number + 1 if known material, 0: solved, -1: unknown
  std::unique_ptr<gpu::Texture> shadowed;       ///< irradiance of lamps lost by occlusion, at 1/shadow_scale
  std::unique_ptr<gpu::Texture> direct_lost;    ///< the same, full size
  std::unique_ptr<gpu::Texture> mirror_lost, mirror_all;  ///< specular radiance by lamps, known material
  std::unique_ptr<gpu::Texture> traced;                   ///< change of irradiance at 1/scale
  std::unique_ptr<gpu::Texture> indirect;                 ///< the same, filtered, full size
  std::unique_ptr<gpu::Texture> gain;                     ///< factor of the radiance in smooth tiles, at 1/smooth_px
  std::unique_ptr<gpu::Texture> live_gain;                ///< the same in the other tiles, at 1/fine_step
  std::unique_ptr<gpu::Texture> mirror_gained, mirror_fraction, mirror_gained_smooth, mirror_fraction_smooth;
  // Output.
  std::unique_ptr<gpu::Texture> object_layer;   ///< radiance of objects times coverage, coverage
  std::unique_ptr<gpu::Texture> object_z;       ///< of their surface in the camera frame; 0: none
  std::unique_ptr<gpu::Texture> delta;          ///< change of radiance of real pixels
  std::unique_ptr<gpu::Texture> room_radiance;  ///< of real pixels before it, clipped channels restored

  /// The part of the supersampled targets that the objects' tiles cover; empty if there are none.
  std::optional<gpu::Area> object_area() const;

  Screen(gpu::Device& device, int width_px, int height_px, int trace_scale, int coarse_shadows, int coarse_ambient,
         int samples, int lamps);
};

}  // namespace lumigraft::relight
