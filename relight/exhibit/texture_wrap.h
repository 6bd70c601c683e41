#pragma once
// Texels of a texture by its coordinates.
#include <algorithm>
#include <array>
#include <cmath>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The texels to both sides of a coordinate, and the weight of the second, for bilinear interpolation. Texel centres
/// are at (x + 1/2) / size.
struct TexelNeighbours {
  std::array<int, 2> texel;
  float weight;
};

/// The texel that is shown in place of one less than a period outside.
inline int wrapped_texel(int texel, int size, Wrap wrap) {
  switch (wrap) {
    case Wrap::clamp_to_edge:
      return std::clamp(texel, 0, size - 1);
    case Wrap::mirrored_repeat: {
      const int in_pair = (texel + 2 * size) % (2 * size);
      return in_pair < size ? in_pair : 2 * size - 1 - in_pair;
    }
    case Wrap::repeat:
      break;
  }
  return (texel + size) % size;
}

inline TexelNeighbours texel_neighbours(float coordinate, int size, Wrap wrap) {
  float once = coordinate - std::floor(coordinate);
  if (wrap == Wrap::clamp_to_edge) once = std::clamp(coordinate, 0.0f, 1.0f);
  if (wrap == Wrap::mirrored_repeat) once = coordinate - 2 * std::floor(coordinate / 2);
  const float x = once * static_cast<float>(size) - 0.5f, first = std::floor(x);
  const int texel = static_cast<int>(first);
  if (texel >= 0 && texel + 1 < size) return {{texel, texel + 1}, x - first};  // most: no division
  return {{wrapped_texel(texel, size, wrap), wrapped_texel(texel + 1, size, wrap)}, x - first};
}

}  // namespace lumigraft::relight
