#pragma once
// The colour camera's picture as it is shown where nothing can be grafted: untouched.
#include "capture/frame.h"
#include "capture/image.h"

namespace lumigraft::server {

/// 8-bit pictures as they came; pictures that hold radiance as round(255 · sRGB(clip(exposure · L, 0, 1))).
capture::Image<std::uint8_t> camera_picture(const capture::Frame& color);

}  // namespace lumigraft::server
