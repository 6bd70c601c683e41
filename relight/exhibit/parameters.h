#pragma once
// Limits of what is read of models and pictures.
#include <cstddef>
#include <cstdint>

namespace lumigraft::relight {
inline constexpr struct ExhibitParameters {
  float max_texcoord = 1e6f;             ///< in units of the texture: floats there are a sixteenth of it apart
  std::int64_t max_picture_edge = 8192;  ///< pixels: 200 MB decoded, and as much as mip levels; every device takes it
  // Alpha masks: the contour is followed in pieces of so many texels, and of `longer` times as many where a limit below
  // is exceeded. After so many divisions of a triangle floats may not resolve its texture coordinates further.
  float contour_texels = 1.5f, longer = 4, max_contour_texels = 4096;
  int max_divisions = 20;
  std::size_t max_more_triangles = 200'000, max_parts = 800'000;  ///< than without a mask; parts that are looked at
  std::int64_t max_texels = 400'000'000;                          ///< that are looked at: half a second
  std::int64_t max_square_texels = 1 << 22;                       ///< at once, to find that all are alike
} kExhibit;
}  // namespace lumigraft::relight
