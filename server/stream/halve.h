#pragma once
// A picture of half the width and height, for viewers whose network does not carry more.
#include <cstdint>

#include "capture/image.h"

namespace lumigraft::server {

/// The mean of each two by two pixels, as stored. An odd last column or row is omitted.
capture::Image<std::uint8_t> halved(const capture::Image<std::uint8_t>& srgb);

}  // namespace lumigraft::server
