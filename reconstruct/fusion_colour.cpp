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
    Picture all;
    all.exposure = picture->exposure;
    all.encoded = Image<std::uint8_t>(256, 1, 3);
    for (std::size_t i = 0; i < all.encoded.data.size(); ++i) all.encoded.data[i] = static_cast<std::uint8_t>(i / 3);
    const RadiancePicture values = to_radiance(all, response);
    for (int code = 0; code < 256; ++code) {
      const auto k = static_cast<std::size_t>(code);
      for (int c = 0; c < 3; ++c) table_[static_cast<std::size_t>(c)][k] = values.radiance.at(code, 0, c);
      clipped_[k] = values.clipped.at(code, 0) != 0;
    }
  }
  width_ = width;
  height_ = height;
}

bool ColourReader::read(int u, int v, float share, Eigen::Vector3f& sum) const {
  const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  if (!codes_) {
    sum += share * Eigen::Map<const Eigen::Vector3f>(&radiance_.radiance.data[3 * i]);
    return radiance_.clipped.data[i] == 0;
  }
  const std::uint8_t* code = codes_ + 3 * i;
  sum += share * Eigen::Vector3f(table_[0][code[0]], table_[1][code[1]], table_[2][code[2]]);
  return !(clipped_[code[0]] || clipped_[code[1]] || clipped_[code[2]]);
}

bool ColourReader::read(const Eigen::Vector2f& pixel, bool nearest, Eigen::Vector3f& radiance) const {
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < static_cast<float>(width_ - 1) &&
        pixel.y() < static_cast<float>(height_ - 1)))
    return false;
  radiance.setZero();
  if (nearest) return read(static_cast<int>(pixel.x() + 0.5f), static_cast<int>(pixel.y() + 0.5f), 1, radiance);
  const int u = static_cast<int>(pixel.x()), v = static_cast<int>(pixel.y());
  const float s = pixel.x() - static_cast<float>(u), t = pixel.y() - static_cast<float>(v);
  return read(u, v, (1 - s) * (1 - t), radiance) && read(u + 1, v, s * (1 - t), radiance) &&
         read(u, v + 1, (1 - s) * t, radiance) && read(u + 1, v + 1, s * t, radiance);
}

}  // namespace lumigraft
