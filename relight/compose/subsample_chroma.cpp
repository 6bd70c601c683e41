#include "relight/compose/subsample_chroma.h"

#include <Eigen/Core>
#include <algorithm>

#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Array3f;

float luma(const Array3f& rgb) { return 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2]; }

/// A block of the picture at (left, top), cut off by its border.
void average(int left, int top, const capture::ChromaBlock& block, capture::Image<std::uint8_t>* picture) {
  const int right = std::min(left + block.width, picture->width),
            bottom = std::min(top + block.height, picture->height);
  const auto codes = [&](int u, int v) {
    const std::uint8_t* from = &picture->data[picture->index(u, v)];
    return Array3f(from[0], from[1], from[2]);
  };
  // Colour without luma is linear in chroma, so its mean is that of mean chroma.
  Array3f mean = Array3f::Zero();
  for (int v = top; v < bottom; ++v) {
    for (int u = left; u < right; ++u) {
      const Array3f rgb = codes(u, v);
      mean += (rgb - luma(rgb)) / static_cast<float>((right - left) * (bottom - top));
    }
  }
  for (int v = top; v < bottom; ++v) {
    for (int u = left; u < right; ++u) {
      const Array3f rounded = (mean + luma(codes(u, v)) + 0.5f).max(0).min(255);
      for (int c = 0; c < 3; ++c) picture->at(u, v, c) = static_cast<std::uint8_t>(rounded[c]);
    }
  }
}

}  // namespace

void subsample_chroma(const capture::ChromaBlock& block, const ObjectLayer& objects,
                      capture::Image<std::uint8_t>* picture) {
  if (block.width * block.height <= 1 || objects.coverage.empty()) return;
  const int first_row = objects.top / block.height,
            end_row = (objects.top + objects.coverage.height - 1) / block.height + 1;
  for_each_index(end_row - first_row, kRows, [&](int row) {
    const int top = (first_row + row) * block.height;
    for (int left = objects.left / block.width * block.width; left < objects.left + objects.coverage.width;
         left += block.width) {
      bool covered = false;
      for (int v = top; v < top + block.height; ++v) {
        for (int u = left; u < left + block.width; ++u) {
          const auto i = objects.index(u, v);
          covered = covered || (i && objects.coverage.data[*i] > 0);
        }
      }
      if (covered) average(left, top, block, picture);
    }
  });
}

}  // namespace lumigraft::relight
