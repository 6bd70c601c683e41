#include "relight/objects/far_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft::relight {
namespace {

constexpr float kFar = 1e12f;
constexpr float kSeedVoxels = 0.75f;  // voxels nearer than this are seeds; bounds the error of the result

/// Lower envelope of parabolas along one line, in place; squared voxels.
void transform_line(std::vector<float>& f, std::vector<int>& parabola, std::vector<float>& from,
                    std::vector<float>& out) {
  const int n = static_cast<int>(f.size());
  int k = -1;
  for (int q = 0; q < n; ++q) {
    if (f[q] >= kFar) continue;
    float s = -std::numeric_limits<float>::infinity();
    while (k >= 0) {
      const int p = parabola[k];
      s = ((f[q] + static_cast<float>(q) * q) - (f[p] + static_cast<float>(p) * p)) /
          (2.0f * static_cast<float>(q - p));
      if (s > from[k]) break;
      --k;
    }
    if (k < 0) s = -std::numeric_limits<float>::infinity();
    ++k;
    parabola[k] = q;
    from[k] = s;
  }
  if (k < 0) return;
  int at = 0;
  for (int q = 0; q < n; ++q) {
    while (at < k && from[at + 1] < static_cast<float>(q)) ++at;
    const float d = static_cast<float>(q - parabola[at]);
    out[q] = d * d + f[parabola[at]];
  }
  std::copy(out.begin(), out.begin() + n, f.begin());
}

}  // namespace

std::vector<float> full_distances(const ObjectField& field) {
  const std::array<std::size_t, 3> size{static_cast<std::size_t>(field.size[0]),
                                        static_cast<std::size_t>(field.size[1]),
                                        static_cast<std::size_t>(field.size[2])};
  std::vector<float> squared(field.distance_m.size());
  for (std::size_t i = 0; i < squared.size(); ++i) {
    squared[i] = std::abs(field.distance_m[i]) <= kSeedVoxels * field.voxel_m ? 0.0f : kFar;
  }
  const std::array<std::size_t, 3> stride{1, size[0], size[0] * size[1]};
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t n = size[axis], u = size[(axis + 1) % 3], v = size[(axis + 2) % 3];
    std::vector<float> line(n), out(n), from(n);
    std::vector<int> parabola(n);
    for (std::size_t b = 0; b < v; ++b) {
      for (std::size_t a = 0; a < u; ++a) {
        float* first = &squared[a * stride[(axis + 1) % 3] + b * stride[(axis + 2) % 3]];
        for (std::size_t i = 0; i < n; ++i) line[i] = first[i * stride[axis]];
        transform_line(line, parabola, from, out);
        for (std::size_t i = 0; i < n; ++i) first[i * stride[axis]] = line[i];
      }
    }
  }
  std::vector<float> full(squared.size());
  for (std::size_t i = 0; i < full.size(); ++i) {
    const float near = field.distance_m[i];
    const float far = (std::sqrt(std::min(squared[i], 1e6f)) - kSeedVoxels) * field.voxel_m;
    full[i] = std::copysign(std::max(std::abs(near), far), near);
    if (std::abs(near) < 2.5f * field.voxel_m) full[i] = near;
  }
  return full;
}

}  // namespace lumigraft::relight
