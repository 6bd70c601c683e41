#include "reconstruct/fusion/color_lookup.h"

namespace lumigraft::reconstruct {

ColorLookup::ColorLookup(const capture::Frame* picture, const capture::Response& response, int width, int height,
                         const Eigen::Array3f& gain, const capture::Image<float>* vignetting) {
  if (!picture) return;
  if (!picture->radiance.empty() || vignetting) {
    radiance_ = capture::to_radiance(*picture, response);
    if (radiance_.radiance.width != width || radiance_.radiance.height != height) return;
    if (vignetting) capture::undo_vignetting(radiance_, *vignetting);
    for (std::size_t i = 0; i < radiance_.radiance.data.size(); ++i)
      radiance_.radiance.data[i] /= gain[static_cast<Eigen::Index>(i % 3)];
  } else {
    if (picture->encoded.width != width || picture->encoded.height != height || picture->encoded.channels != 3) return;
    pixels_ = picture->encoded.data.data();
    // Table of the radiance of each pixel value, from an image that contains all of them.
    capture::Frame all;
    all.exposure = picture->exposure;
    all.encoded = capture::Image<std::uint8_t>(256, 1, 3);
    for (std::size_t i = 0; i < all.encoded.data.size(); ++i) all.encoded.data[i] = static_cast<std::uint8_t>(i / 3);
    const capture::RadianceImage values = capture::to_radiance(all, response);
    for (int value = 0; value < 256; ++value)
      for (int c = 0; c < 3; ++c) {
        Simd4& entry = table_[static_cast<std::size_t>(c)][static_cast<std::size_t>(value)];
        entry[c] = values.radiance.at(value, 0, c) / gain[c];
        entry[3] = values.clipped.at(value, 0) != 0 ? 1 : 0;
      }
  }
  width_ = width;
  height_ = height;
}

}  // namespace lumigraft::reconstruct
