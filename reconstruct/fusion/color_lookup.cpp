#include "reconstruct/fusion/color_lookup.h"

namespace lumigraft::reconstruct {

ColorLookup::ColorLookup(const capture::Picture* picture, const capture::Response& response, int width, int height) {
  if (!picture) return;
  if (!picture->radiance.empty()) {
    radiance_ = capture::to_radiance(*picture, response);
    if (radiance_.radiance.width != width || radiance_.radiance.height != height) return;
  } else {
    if (picture->encoded.width != width || picture->encoded.height != height || picture->encoded.channels != 3) return;
    codes_ = picture->encoded.data.data();
    // What each code stands for, from a picture of all of them.
    capture::Picture every;
    every.exposure = picture->exposure;
    every.encoded = capture::Image<std::uint8_t>(256, 1, 3);
    for (std::size_t i = 0; i < every.encoded.data.size(); ++i)
      every.encoded.data[i] = static_cast<std::uint8_t>(i / 3);
    const capture::RadiancePicture values = capture::to_radiance(every, response);
    for (int code = 0; code < 256; ++code)
      for (int c = 0; c < 3; ++c) {
        Simd4& entry = table_[static_cast<std::size_t>(c)][static_cast<std::size_t>(code)];
        entry[c] = values.radiance.at(code, 0, c);
        entry[3] = values.clipped.at(code, 0) != 0 ? 1 : 0;
      }
  }
  width_ = width;
  height_ = height;
}

}  // namespace lumigraft::reconstruct
