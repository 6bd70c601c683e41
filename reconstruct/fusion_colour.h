#pragma once
// Radiance at places of a colour picture, read from its codes where it is needed.
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "capture/frame.h"
#include "capture/radiance.h"
#include "reconstruct/four.h"

namespace lumigraft {

class ColourReader {
 public:
  /// `picture` may be null, or of another size than the camera: then nothing can be read.
  ColourReader(const Picture* picture, const Response& response, int width, int height);

  explicit operator bool() const { return width_ > 0; }
  /// Bilinear, or of the nearest pixel; false outside the picture, and where any pixel it needs is clipped. The fourth
  /// of `radiance` is of no use.
  bool read(float u, float v, bool nearest, Four& radiance) const;
  /// To be called some time before pixels are read.
  void fetch(int u, int v) const {
    if (codes_) __builtin_prefetch(codes_ + 3 * (v * width_ + u));
  }

 private:
  Four at(std::size_t pixel) const;

  int width_ = 0, height_ = 0;
  const std::uint8_t* codes_ = nullptr;  ///< null where the picture holds radiance
  RadiancePicture radiance_;
  std::array<std::array<Four, 256>, 3> table_{};  ///< by channel and code; the fourth is 1 for clipped codes
};

}  // namespace lumigraft
