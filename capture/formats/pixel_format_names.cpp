#include <algorithm>

#include "capture/formats/pixel_format.h"

namespace lumigraft::capture {
namespace {

struct FormatInfo {
  PixelFormat format;
  std::string_view name;
  std::array<char, 4> fourcc;
};

// The four-character codes are libav's, which most players use for the same formats.
constexpr std::array<FormatInfo, 13> kFormats = {{
    {PixelFormat::rgb8, "rgb8", {'R', 'G', 'B', 24}},
    {PixelFormat::bgr8, "bgr8", {'B', 'G', 'R', 24}},
    {PixelFormat::grey8, "grey8", {'Y', '8', '0', '0'}},
    {PixelFormat::grey10, "grey10", {'Y', '1', 0, 10}},
    {PixelFormat::grey12, "grey12", {'Y', '1', 0, 12}},
    {PixelFormat::grey16, "grey16", {'Y', '1', 0, 16}},
    {PixelFormat::bayer_rggb8, "bayer-rggb8", {static_cast<char>(0xBA), 'R', 'G', 8}},
    {PixelFormat::bayer_bggr8, "bayer-bggr8", {static_cast<char>(0xBA), 'B', 'G', 8}},
    {PixelFormat::bayer_gbrg8, "bayer-gbrg8", {static_cast<char>(0xBA), 'G', 'B', 8}},
    {PixelFormat::bayer_grbg8, "bayer-grbg8", {static_cast<char>(0xBA), 'G', 'R', 8}},
    {PixelFormat::yuyv, "yuyv", {'Y', 'U', 'Y', '2'}},
    {PixelFormat::uyvy, "uyvy", {'U', 'Y', 'V', 'Y'}},
    {PixelFormat::nv12, "nv12", {'N', 'V', '1', '2'}},
}};

/// The first format whose member equals `value`; null if there is none.
const FormatInfo* find(const auto& value, auto FormatInfo::*member) {
  const auto* found = std::ranges::find(kFormats, value, member);
  return found != kFormats.end() ? found : nullptr;
}

}  // namespace

std::string_view name_of(PixelFormat format) {
  const FormatInfo* info = find(format, &FormatInfo::format);
  return info != nullptr ? info->name : format == PixelFormat::z16 ? "z16" : "mjpeg";
}

std::optional<PixelFormat> pixel_format_named(std::string_view name) {
  const FormatInfo* info = find(name, &FormatInfo::name);
  return info != nullptr   ? std::optional(info->format)
         : name == "mjpeg" ? std::optional(PixelFormat::mjpeg)
         : name == "z16"   ? std::optional(PixelFormat::z16)
                           : std::nullopt;
}

std::optional<std::array<char, 4>> fourcc_of(PixelFormat format) {
  const FormatInfo* info = find(format, &FormatInfo::format);
  return info != nullptr ? std::optional(info->fourcc) : std::nullopt;
}

std::optional<PixelFormat> pixel_format_of(const std::array<char, 4>& fourcc) {
  const FormatInfo* info = find(fourcc, &FormatInfo::fourcc);
  return info != nullptr ? std::optional(info->format) : std::nullopt;
}

int grey_bits(PixelFormat format) {
  switch (format) {
    case PixelFormat::grey8:
      return 8;
    case PixelFormat::grey10:
      return 10;
    case PixelFormat::grey12:
      return 12;
    case PixelFormat::grey16:
      return 16;
    default:
      return 0;
  }
}

bool is_yuv(PixelFormat format) {
  return format == PixelFormat::yuyv || format == PixelFormat::uyvy || format == PixelFormat::nv12;
}

}  // namespace lumigraft::capture
