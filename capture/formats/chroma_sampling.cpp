#include "capture/formats/chroma_sampling.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace lumigraft::capture {
namespace {

/// By the sampling factors in the frame header (ITU-T T.81, 1992, B.2.2).
ChromaBlock of_jpeg(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t kMarker = 0xff, kScan = 0xda;
  constexpr std::size_t kComponents = 9, kComponentBytes = 3;  // offset of their number in the header; of one
  std::size_t at = 2;                                          // after the start of the image
  while (at + 4 <= bytes.size() && bytes[at] == kMarker && bytes[at + 1] != kScan) {
    const std::uint8_t kind = bytes[at + 1];
    const std::size_t length = std::size_t{256} * bytes[at + 2] + bytes[at + 3];
    const bool frame_header = kind >= 0xc0 && kind <= 0xcf && kind != 0xc4 && kind != 0xc8 && kind != 0xcc;
    if (!frame_header) {
      at += 2 + length;
      continue;
    }
    if (at + kComponents + 3 * kComponentBytes >= bytes.size() || bytes[at + kComponents] != 3) return {};
    const auto factors = [&](std::size_t component) {
      const std::uint8_t both = bytes[at + kComponents + 2 + kComponentBytes * component];
      return ChromaBlock{both >> 4, both & 15};
    };
    const ChromaBlock luma = factors(0), blue = factors(1), red = factors(2);
    if (blue.width != red.width || blue.height != red.height || blue.width < 1 || blue.height < 1) return {};
    return {std::max(luma.width / blue.width, 1), std::max(luma.height / blue.height, 1)};
  }
  return {};
}

}  // namespace

ChromaBlock chroma_block(const RawFrame& frame) {
  switch (frame.format) {
    case PixelFormat::yuyv:
    case PixelFormat::uyvy:
      return {2, 1};
    case PixelFormat::nv12:
      return {2, 2};
    case PixelFormat::mjpeg:
      return of_jpeg(frame.bytes);
    default:
      return {};
  }
}

}  // namespace lumigraft::capture
