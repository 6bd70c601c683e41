#include "relight/exhibit/picture_decode.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "capture/error.h"
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

void check_size(std::int64_t width, std::int64_t height) {
  capture::refuse_if(width < 1 || height < 1, kBroken);
  capture::refuse_if(width > kExhibit.max_picture_edge || height > kExhibit.max_picture_edge,
                     "found " + std::to_string(width) + " x " + std::to_string(height) + " pixels, allowed: at most " +
                         std::to_string(kExhibit.max_picture_edge) + " along an edge");
}

/// Throws InputError if it cannot be read.
cv::Mat decoded(Bytes bytes, int flags, std::int64_t max_texels) {
  if (const auto header = picture_header(bytes)) check_size(header->width, header->height);
  cv::Mat picture;
  try {
    const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::uint8_t*>(bytes.data()));
    if (!bytes.empty()) picture = cv::imdecode(encoded, flags | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) throw capture::InputError(kBroken);
  check_size(picture.cols, picture.rows);
  if (const int times = halvings(picture.cols, picture.rows, max_texels); times > 0) {
    const cv::Size size(std::max(picture.cols >> times, 1), std::max(picture.rows >> times, 1));
    cv::resize(picture, picture, size, 0, 0, cv::INTER_AREA);
  }
  return picture;
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
  const cv::Mat picture = decoded(bytes, cv::IMREAD_COLOR, max_texels);
  auto image = std::make_shared<capture::Image<std::uint8_t>>(picture.cols, picture.rows, 3);
  cv::cvtColor(picture, cv::Mat(picture.rows, picture.cols, CV_8UC3, image->data.data()), cv::COLOR_BGR2RGB);
  return image;
}

std::shared_ptr<const capture::Image<std::uint8_t>> decode_alpha(Bytes bytes, std::int64_t max_texels) {
  cv::Mat picture = decoded(bytes, cv::IMREAD_UNCHANGED, max_texels);
  if (picture.channels() != 4) return nullptr;
  if (picture.depth() == CV_16U) picture.convertTo(picture, CV_8U, 1 / 257.0);
  if (picture.depth() != CV_8U) throw capture::InputError(kBroken);
  auto image = std::make_shared<capture::Image<std::uint8_t>>(picture.cols, picture.rows, 1);
  cv::extractChannel(picture, cv::Mat(picture.rows, picture.cols, CV_8UC1, image->data.data()), 3);
  return image;
}

}  // namespace lumigraft::relight
