#pragma once
// Radiance at places of a colour picture, read from its codes where it is needed.
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "capture/frame.h"
#include "capture/radiance.h"

namespace lumigraft {

class ColourReader {
 public:
  /// `picture` may be null, or of another size than the camera: then nothing can be read.
  ColourReader(const Picture* picture, const Response& response, int width, int height);

  explicit operator bool() const { return width_ > 0; }
  /// Bilinear, or of the nearest pixel; false outside the picture, and where any pixel it needs is clipped.
  bool read(const Eigen::Vector2f& pixel, bool nearest, Eigen::Vector3f& radiance) const;

 private:
  bool read(int u, int v, float share, Eigen::Vector3f& sum) const;

  int width_ = 0, height_ = 0;
  const std::uint8_t* codes_ = nullptr;  ///< null where the picture holds radiance
  RadiancePicture radiance_;
  std::array<std::array<float, 256>, 3> table_{};
  std::array<bool, 256> clipped_{};
};

}  // namespace lumigraft
