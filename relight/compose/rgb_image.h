#pragma once
// Access to the pixels of linear images of three channels.
#include "capture/image.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// The radiance of the pixel with index i.
inline Rgb radiance_at(const capture::Image<float>& image, std::size_t i) {
  return {image.data[3 * i], image.data[3 * i + 1], image.data[3 * i + 2]};
}
inline void set_at(capture::Image<float>& image, std::size_t i, const Rgb& value) {
  for (std::size_t c = 0; c < 3; ++c) image.data[3 * i + c] = value[static_cast<Eigen::Index>(c)];
}

}  // namespace lumigraft::relight
