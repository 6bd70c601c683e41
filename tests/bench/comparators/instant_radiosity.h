#pragma once
// Differential instant radiosity (Knecht et al. 2010) with imperfect shadow maps (Ritschel et al. 2008), on the CPU.
//
// L_ρ - L_μ, where each is direct light and virtual point lights; both scenes share their random numbers, so that what
// no object touches cancels exactly. Lamps and sky are shadowed by rays, which is better than the shadow maps of both
// papers. A virtual light has a map of either scene, and its geometry term is bounded by the area that it stands for
// (Keller 1997 has it unbounded; it shrinks as lights are added). One ray for a pixel, through its centre.
#include <cstdint>
#include <memory>

#include "relight/reference/delta_path_tracer.h"

namespace lumigraft::comparators {

struct InstantRadiosityOptions {
  int light_paths = 256;
  int bounces = 2;                               ///< vertices of a path
  int lamp_rays = 8;                             ///< to each lamp, from every pixel
  int sky_rays = 64;                             ///< in directions that all pixels share
  int real_points = 4096, object_points = 2048;  ///< in each map
  int map_edge = 64;                             ///< texels
  std::uint32_t seed = 0;
};

/// `change` and `object` as in DeltaPathTracer; a pixel is covered or isn't.
relight::ReferencePicture instant_radiosity(const std::shared_ptr<const relight::ReferenceScene>& scene,
                                            const relight::PosedCamera& camera, const InstantRadiosityOptions& options);

}  // namespace lumigraft::comparators
