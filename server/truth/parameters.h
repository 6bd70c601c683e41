#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <numbers>

namespace lumigraft::server {
inline constexpr struct TruthParameters {
  double points = 4000, field_rad = 359.9 / 180 * std::numbers::pi;  ///< in all; 360° would have no edge in a picture
  float ray_offset_m = 1e-3f, same_surface_m = 5e-5f;  ///< from the surface; paper on a surface is thicker
  float band_voxels = 2, same_surface_voxels = 3;  ///< around the surface, with albedo; depth of a pixel that sees it
  float same_lamp_rad = 0.087f, albedo_sigma = 0.01f;  ///< 5°: centroid to lamp; quantisation of an 8-bit texture
  int samples = 5;                                     ///< per pixel edge: the sun is about as wide as a pixel
} kTruth;
}  // namespace lumigraft::server
