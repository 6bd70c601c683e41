#pragma once
// Differential instant radiosity (Knecht et al. 2010) with imperfect shadow maps (Ritschel et al. 2008), on the CPU.
//
// Computes L_ρ - L_μ, each as direct light plus virtual point lights; both scenes share their random numbers, so that
// paths that hit no object cancel exactly. Lamps and sky are shadowed by rays, more accurately than by the shadow maps
// of both papers. A virtual light has a map per scene, and its geometry term is clamped by the area that it represents
// (unclamped in Keller 1997; the bound shrinks with more lights). One ray per pixel, through its centre.
#include <cstdint>
#include <memory>

#include "relight/reference/delta_path_tracer.h"

namespace lumigraft::comparators {

struct InstantRadiosityOptions {
  int light_paths = 256;
  int bounces = 2;                               ///< vertices per path
  int lamp_rays = 8;                             ///< per lamp and pixel
  int sky_rays = 64;                             ///< in directions shared by all pixels
  int real_points = 4096, object_points = 2048;  ///< per map
  int map_edge = 64;                             ///< texels
  std::uint32_t seed = 0;
};

/// `change` and `object` as in DeltaPathTracer; coverage is 0 or 1.
relight::ReferencePicture instant_radiosity(const std::shared_ptr<const relight::ReferenceScene>& scene,
                                            const relight::PosedCamera& camera, const InstantRadiosityOptions& options);

}  // namespace lumigraft::comparators
