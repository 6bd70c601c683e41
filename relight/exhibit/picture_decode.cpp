#include "relight/exhibit/picture_decode.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "capture/error.h"
#include "capture/formats/coded_picture.h"
#include "relight/exhibit/parameters.h"

namespace lumigraft::relight {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr const char* kBroken = "found a broken picture, allowed: one that can be decoded";

bool has(Bytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() && std::memcmp(bytes.data() + at, text.data(), text.size()) == 0;
}

std::int64_t big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::int64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | bytes[at + i];
  return value;
}

std::int64_t little_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::int64_t value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | bytes[at + i];
  return value;
}

/// Of the first frame header (ITU-T T.81, B.2.2), after segments of known length.
PictureHeader jpeg_header(Bytes bytes) {
  PictureHeader header{.mime = "image/jpeg"};
  for (std::size_t at = 2; at + 9 <= bytes.size() && bytes[at] == 0xff;) {
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xff) {  // padding
      ++at;
      continue;
    }
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) {
      header.height = big_endian(bytes, at + 5, 2);
      header.width = big_endian(bytes, at + 7, 2);
      break;
    }
    at += 2 + static_cast<std::size_t>(big_endian(bytes, at + 2, 2));
  }
  return header;
}

/// Of the first chunk (RFC 9649): lossy, lossless or extended.
PictureHeader webp_header(Bytes bytes) {
  PictureHeader header{.mime = "image/webp"};
  if (bytes.size() < 30) return header;
  if (has(bytes, 12, "VP8 ")) {
    header.width = little_endian(bytes, 26, 2) & 0x3fff;
    header.height = little_endian(bytes, 28, 2) & 0x3fff;
  } else if (has(bytes, 12, "VP8L")) {
    const std::int64_t sizes = little_endian(bytes, 21, 4);
    header.width = 1 + (sizes & 0x3fff);
    header.height = 1 + (sizes >> 14 & 0x3fff);
  } else if (has(bytes, 12, "VP8X")) {
    header.width = 1 + little_endian(bytes, 24, 3);
    header.height = 1 + little_endian(bytes, 27, 3);
  }
  return header;
}

/// R G B, or R G B A where the picture has alpha. Throws InputError if it cannot be read.
capture::Image<std::uint8_t> decoded(Bytes bytes, std::int64_t max_texels) {
  constexpr auto kMaxEdge = static_cast<int>(kExhibit.max_picture_edge);
  // Before the decoder sees it: a header may state any size.
  if (const auto header = picture_header(bytes)) capture::refuse_large_picture(header->width, header->height, kMaxEdge);
  capture::Image<std::uint8_t> picture = capture::decode_coded_picture(bytes, kMaxEdge);
  capture::refuse_if(picture.empty(), kBroken);
  const int times = halvings(picture.width, picture.height, max_texels);
  if (times == 0) return picture;
  capture::Image<std::uint8_t> small(std::max(picture.width >> times, 1), std::max(picture.height >> times, 1),
                                     picture.channels);
  const int type = CV_8UC(picture.channels);
  cv::Mat out(small.height, small.width, type, small.data.data());
  cv::resize(cv::Mat(picture.height, picture.width, type, picture.data.data()), out, out.size(), 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

std::optional<PictureHeader> picture_header(Bytes bytes) {
  if (has(bytes, 0, "\x89PNG\r\n\x1a\n")) {
    PictureHeader header{.mime = "image/png"};
    if (bytes.size() < 24) return header;
    header.width = big_endian(bytes, 16, 4);
    header.height = big_endian(bytes, 20, 4);
    return header;
  }
  if (has(bytes, 0, "\xff\xd8\xff")) return jpeg_header(bytes);
  if (has(bytes, 0, "RIFF") && has(bytes, 8, "WEBP")) return webp_header(bytes);
  return std::nullopt;
}

int halvings(std::int64_t width, std::int64_t height, std::int64_t max_texels) {
  int times = 0;
  // Without a product, as a header may state any size.
  while ((width >> times) > max_texels / std::max<std::int64_t>(height >> times, 1)) ++times;
  return times;
}

TexturePicture decode_picture(Bytes bytes, std::int64_t max_texels) {
  return std::make_shared<capture::Image<std::uint8_t>>(capture::without_alpha(decoded(bytes, max_texels)));
}

std::shared_ptr<const capture::Image<std::uint8_t>> decode_alpha(Bytes bytes, std::int64_t max_texels) {
  const capture::Image<std::uint8_t> picture = decoded(bytes, max_texels);
  if (picture.channels != 4) return nullptr;
  auto alpha = std::make_shared<capture::Image<std::uint8_t>>(picture.width, picture.height, 1);
  for (std::size_t i = 0; i < alpha->data.size(); ++i) alpha->data[i] = picture.data[4 * i + 3];
  return alpha;
}

}  // namespace lumigraft::relight
