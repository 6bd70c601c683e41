#pragma once
// Pictures of textures: PNG, JPEG, WebP and what else capture/formats/coded_picture.h reads.
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// What the first bytes of a picture say.
struct PictureHeader {
  std::string_view mime;  ///< "image/png", "image/jpeg" or "image/webp"
  std::int64_t width = 0, height = 0;
};

/// Nothing if the bytes begin as none of these files.
std::optional<PictureHeader> picture_header(std::span<const std::uint8_t> bytes);

inline constexpr std::int64_t kAllTexels = std::numeric_limits<std::int64_t>::max();

/// How often a picture of this size is halved so that it has at most so many texels.
int halvings(std::int64_t width, std::int64_t height, std::int64_t max_texels);

/// As stored: orientation and colour profiles are ignored, as glTF demands. A picture with more texels than that is
/// scaled down by a power of 2; each pixel is the mean of the values that it replaces, as they are encoded. Throws
/// InputError, without the picture's place, if it cannot be read or is larger than 8192 pixels along an edge, before
/// any pixel is decoded.
TexturePicture decode_picture(std::span<const std::uint8_t> bytes, std::int64_t max_texels = kAllTexels);
/// Alpha of a picture that `decode_picture` reads, 1 channel; null: it has none.
std::shared_ptr<const capture::Image<std::uint8_t>> decode_alpha(std::span<const std::uint8_t> bytes,
                                                                 std::int64_t max_texels = kAllTexels);

}  // namespace lumigraft::relight
