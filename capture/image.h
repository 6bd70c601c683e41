#pragma once
// An image in memory: row-major, top row first, channels interleaved (R, G, B).
#include <cstddef>
#include <vector>

namespace lumigraft::capture {

template <typename T>
struct Image {
  int width = 0, height = 0;
  int channels = 1;
  std::vector<T> data;

  Image() = default;
  Image(int width_px, int height_px, int channel_count, T fill = T{})
      : width(width_px),
        height(height_px),
        channels(channel_count),
        data(static_cast<std::size_t>(width_px) * height_px * channel_count, fill) {}

  bool empty() const { return data.empty(); }
  std::size_t index(int x, int y, int c = 0) const { return (static_cast<std::size_t>(y) * width + x) * channels + c; }
  T& at(int x, int y, int c = 0) { return data[index(x, y, c)]; }
  const T& at(int x, int y, int c = 0) const { return data[index(x, y, c)]; }
};

}  // namespace lumigraft::capture
