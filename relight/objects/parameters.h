#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <cstddef>

namespace lumigraft::relight {
inline constexpr struct ObjectParameters {
  float seed_voxels = 0.75f, max_far2 = 1e6f;   ///< to the surface, for seeds: bounds the error; squared voxels
  float same_normal = 0.9995f, near_m = 1e-3f;  ///< between triangles of one flat piece: cosine of 1.8°; planes
  float flat = 0.98f, closed = 1e-3f;  ///< cosine to vertex normals; |sum of area-weighted normals| of a closed surface
  float min_area_m2 = 2.5e-3f, min_area = 0.02f;  ///< of a piece: 5 cm × 5 cm; fraction of the model's area
  float seam = 1e-6f;                             ///< tolerance of a triangle's edge, so that neighbours leave no seam
  std::size_t tried = 64, max_pieces = 256;    ///< triangles for a rectangle; on fine curves further ones are as small
  float inner_edge = 2.6f, outer_edge = 3.5f;  ///< of the volumes: radii of the objects' sphere; inner edges
  float min_visible = 0.02f;                   ///< light of objects that emit; radiance, 1: white
  int margin = 3;                              ///< voxels of the virtual volume on each side
  /// Of what stands on the room: rays along each edge of the footprint, and how many must find the surface; what is
  /// lower than this fraction of the height belongs to the footprint.
  int foot_rays = 7;
  std::size_t min_foot_rays = 3;
  float foot_height = 0.1f;
  /// Of the mean of a texture over a parallelogram: at least so many texels are across its width, and at most twice as
  /// many, unless more than so many were along it. Taps per texel are those of the finest level.
  float texels_of_width = 4, texels_of_length = 64, taps_per_texel = 2;
  int max_tap_span = 96;            ///< texels of an axis over which taps are summed by texel: √2 texels_of_length,
  float far_texels = 1e6f;          ///< unless they are farther from the first than floats resolve
  int even_range = 6;               ///< of 255: colours that differ by more are averaged so
  double max_cone_fraction = 0.05;  ///< area of the cones that close a solid part over its own
} kObjects;
}  // namespace lumigraft::relight
