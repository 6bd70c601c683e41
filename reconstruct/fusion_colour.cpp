#include "reconstruct/fusion_colour.h"

namespace lumigraft {

ColourReader::ColourReader(const Picture* picture, const Response& response, int width, int height) {
  if (!picture) return;
  if (!picture->radiance.empty()) {
    radiance_ = to_radiance(*picture, response);
    if (radiance_.radiance.width != width || radiance_.radiance.height != height) return;
  } else {
    if (picture->encoded.width != width || picture->encoded.height != height || picture->encoded.channels != 3) return;
    codes_ = picture->encoded.data.data();
    // What each code stands for, from a picture of all of them.
    Picture every;
    every.exposure = picture->exposure;
    every.encoded = Image<std::uint8_t>(256, 1, 3);
    for (std::size_t i = 0; i < every.encoded.data.size(); ++i)
      every.encoded.data[i] = static_cast<std::uint8_t>(i / 3);
    const RadiancePicture values = to_radiance(every, response);
    for (int code = 0; code < 256; ++code)
      for (int c = 0; c < 3; ++c) {
        Four& entry = table_[static_cast<std::size_t>(c)][static_cast<std::size_t>(code)];
        entry[c] = values.radiance.at(code, 0, c);
        entry[3] = values.clipped.at(code, 0) != 0 ? 1 : 0;
      }
  }
  width_ = width;
  height_ = height;
}

Four ColourReader::at(std::size_t pixel) const {
  if (!codes_) {
    const float* radiance = &radiance_.radiance.data[3 * pixel];
    return Four{radiance[0], radiance[1], radiance[2], static_cast<float>(radiance_.clipped.data[pixel])};
  }
  const std::uint8_t* code = codes_ + 3 * pixel;
  return table_[0][code[0]] + table_[1][code[1]] + table_[2][code[2]];
}

bool ColourReader::read(float u, float v, bool nearest, Four& radiance) const {
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
  const Four a = at(first), b = at(first + 1), c = at(below), d = at(below + 1);
  radiance = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
  return a[3] + b[3] + c[3] + d[3] == 0;
}

}  // namespace lumigraft
