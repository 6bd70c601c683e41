#pragma once
// Radiance at positions of a colour image, converted from its pixel values only where it is read.
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "capture/camera/radiance.h"
#include "capture/frame.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

class ColorLookup {
 public:
  /// `picture` may be null or of another size than the camera: then there is nothing to read.
  /// `gain`: linear pixel value over exposure × radiance (FrameSet::color_gain). `vignetting`: FrameSet's, or null.
  ColorLookup(const capture::Frame* picture, const capture::Response& response, int width, int height,
              const Eigen::Array3f& gain = Eigen::Array3f::Ones(), const capture::Image<float>* vignetting = nullptr);

  explicit operator bool() const { return width_ > 0; }
  /// Bilinear, or that of the nearest pixel. False outside the image and if a pixel it needs is clipped. Lane 3 of
  /// `radiance` is unused.
  bool read(float u, float v, bool nearest, Simd4& radiance) const;
  /// Prefetches a pixel that will be read soon.
  void prefetch(int u, int v) const {
    if (pixels_) __builtin_prefetch(pixels_ + 3 * (v * width_ + u));
  }

 private:
  Simd4 at(std::size_t pixel) const;

  int width_ = 0, height_ = 0;
  const std::uint8_t* pixels_ = nullptr;  ///< null if the image holds radiance
  capture::RadianceImage radiance_;
  std::array<std::array<Simd4, 256>, 3> table_{};  ///< by channel and pixel value; lane 3 is 1 for clipped values
};

[[gnu::always_inline]] inline Simd4 ColorLookup::at(std::size_t pixel) const {
  if (!pixels_) {
    const float* radiance = &radiance_.radiance.data[3 * pixel];
    return Simd4{radiance[0], radiance[1], radiance[2], static_cast<float>(radiance_.clipped.data[pixel])};
  }
  const std::uint8_t* value = pixels_ + 3 * pixel;
  return table_[0][value[0]] + table_[1][value[1]] + table_[2][value[2]];
}

[[gnu::always_inline]] inline bool ColorLookup::read(float u, float v, bool nearest, Simd4& radiance) const {
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_ - 1) && v < static_cast<float>(height_ - 1))) return false;
  const auto pixel = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  };
  if (nearest) {
    radiance = at(pixel(static_cast<int>(u + 0.5f), static_cast<int>(v + 0.5f)));
    return radiance[3] == 0;
  }
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const float s = u - static_cast<float>(x), t = v - static_cast<float>(y);
  const std::size_t first = pixel(x, y), below = pixel(x, y + 1);
  const Simd4 a = at(first), b = at(first + 1), c = at(below), d = at(below + 1);
  radiance = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
  return a[3] + b[3] + c[3] + d[3] == 0;
}

}  // namespace lumigraft::reconstruct
