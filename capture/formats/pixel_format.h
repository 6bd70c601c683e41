#pragma once
// What cameras call a picture, and the RGB picture it stands for. A picture that is recorded as the camera gave it
// comes out the same when it is replayed.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/image.h"

namespace lumigraft::capture {

enum class PixelFormat {
  rgb8,
  bgr8,
  grey8,
  grey16,  ///< little-endian; its upper eight bits are shown
  bayer_rggb8,
  bayer_bggr8,
  bayer_gbrg8,
  bayer_grbg8,
  yuyv,  ///< 4:2:2, BT.601, 16 to 235
  nv12,  ///< 4:2:0, BT.601, 16 to 235
  mjpeg
};

/// The word for it in configurations.
std::string_view name_of(PixelFormat format);
std::optional<PixelFormat> pixel_format_named(std::string_view name);
/// Of uncompressed video in Matroska. Empty for mjpeg, which is a codec there.
std::optional<std::array<char, 4>> fourcc_of(PixelFormat format);
std::optional<PixelFormat> pixel_format_of(const std::array<char, 4>& fourcc);

/// A picture as the camera gave it, rows without padding. Its bytes may be the driver's own memory, lent for as long as
/// the picture lives.
struct CameraPicture {
  CameraPicture() = default;
  CameraPicture(PixelFormat pixel_format, std::vector<std::uint8_t> own_bytes);
  CameraPicture(PixelFormat pixel_format, std::span<const std::uint8_t> lent_bytes, std::shared_ptr<const void> lender);

  PixelFormat format = PixelFormat::rgb8;
  std::span<const std::uint8_t> bytes;
  std::shared_ptr<const void> keeps_bytes;
};

/// Bytes of a picture without padding; empty where that depends on the picture, or the format has no such size.
std::optional<std::size_t> bytes_of(PixelFormat format, int width, int height);

/// The rows of an uncompressed picture that stand `row_bytes` apart, one after the other (of nv12 the rows of both its
/// planes). Empty where the bytes are too few.
std::vector<std::uint8_t> without_padding(PixelFormat format, int width, int height, std::size_t row_bytes,
                                          std::span<const std::uint8_t> bytes);

/// Keeps what libav needs from one picture to the next.
class PixelConverter {
 public:
  PixelConverter();
  ~PixelConverter();

  /// Empty where the bytes are no such picture: too few, or a damaged JPEG.
  std::optional<Image<std::uint8_t>> to_rgb(PixelFormat format, int width, int height,
                                            std::span<const std::uint8_t> bytes);

 private:
  class Libav;
  std::unique_ptr<Libav> libav_;
};

}  // namespace lumigraft::capture
