#pragma once
// Pixel formats of cameras and their conversion to RGB. Frames are recorded in the camera's format, and the conversion
// is deterministic, so a replay gives the same RGB.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "capture/image.h"

namespace lumigraft::capture {

enum class PixelFormat {
  rgb8,
  bgr8,
  grey8,
  grey10,  ///< in 16 bits, little-endian, the upper ones 0; its upper eight bits become RGB, as of the next two
  grey12,
  grey16,
  bayer_rggb8,
  bayer_bggr8,
  bayer_gbrg8,
  bayer_grbg8,
  yuyv,  ///< 4:2:2, BT.601, limited range 16 to 235
  uyvy,  ///< the same, chroma first
  nv12,  ///< 4:2:0, BT.601, limited range 16 to 235
  mjpeg,
  z16  ///< depth, 16 bits, little-endian
};

/// Name in configurations.
std::string_view name_of(PixelFormat format);
std::optional<PixelFormat> pixel_format_named(std::string_view name);
/// Code of uncompressed video in Matroska. Empty for mjpeg, which is a codec there, and for z16, recorded as grey16.
std::optional<std::array<char, 4>> fourcc_of(PixelFormat format);
std::optional<PixelFormat> pixel_format_of(const std::array<char, 4>& fourcc);

/// A frame in the camera's pixel format, rows without padding. Its bytes may be the driver's memory, borrowed until the
/// last copy of `keeps_bytes` is gone.
struct RawFrame {
  RawFrame() = default;
  RawFrame(PixelFormat pixel_format, std::vector<std::uint8_t> own_bytes);
  RawFrame(PixelFormat pixel_format, std::span<const std::uint8_t> lent_bytes, std::shared_ptr<const void> lender);

  PixelFormat format = PixelFormat::rgb8;
  std::span<const std::uint8_t> bytes;
  std::shared_ptr<const void> keeps_bytes;
};

/// Bits of a grey pixel; 0 for other formats.
int grey_bits(PixelFormat format);
bool is_yuv(PixelFormat format);

/// Bytes of a frame without padding; empty for mjpeg and for sizes that the format does not support.
std::optional<std::size_t> bytes_of(PixelFormat format, int width, int height);

/// Copies the rows of an uncompressed frame, which start `row_bytes` apart, without the padding between them (nv12: the
/// rows of both planes). Empty if there are too few bytes.
std::vector<std::uint8_t> without_padding(PixelFormat format, int width, int height, std::size_t row_bytes,
                                          std::span<const std::uint8_t> bytes);

/// As without_padding, for nv12 with luma and chroma in separate memory.
std::vector<std::uint8_t> nv12_without_padding(int width, int height, const std::array<std::size_t, 2>& row_bytes,
                                               const std::array<std::span<const std::uint8_t>, 2>& planes);

/// Depth of z16 or grey16. Empty if the bytes are not exactly those of a frame.
std::optional<Image<std::uint16_t>> to_counts(int width, int height, std::span<const std::uint8_t> bytes);

/// Converts frames to RGB; keeps libav's decoder and scaler from one frame to the next.
class PixelConverter {
 public:
  PixelConverter();
  ~PixelConverter();

  /// Empty if the bytes are no such frame: too few, or a damaged JPEG.
  std::optional<Image<std::uint8_t>> to_rgb(PixelFormat format, int width, int height,
                                            std::span<const std::uint8_t> bytes);

 private:
  class Libav;
  std::unique_ptr<Libav> libav_;
};

}  // namespace lumigraft::capture
