#include "capture/aravis_library.h"

#include <algorithm>
#include <array>

namespace lumigraft::aravis {
namespace {

struct Pair {
  ArvPixelFormat aravis;
  PixelFormat ours;
};

constexpr std::array<Pair, 8> kFormats = {{{ARV_PIXEL_FORMAT_BAYER_RG_8, PixelFormat::bayer_rggb8},
                                           {ARV_PIXEL_FORMAT_BAYER_BG_8, PixelFormat::bayer_bggr8},
                                           {ARV_PIXEL_FORMAT_BAYER_GB_8, PixelFormat::bayer_gbrg8},
                                           {ARV_PIXEL_FORMAT_BAYER_GR_8, PixelFormat::bayer_grbg8},
                                           {ARV_PIXEL_FORMAT_RGB_8_PACKED, PixelFormat::rgb8},
                                           {ARV_PIXEL_FORMAT_BGR_8_PACKED, PixelFormat::bgr8},
                                           {ARV_PIXEL_FORMAT_MONO_8, PixelFormat::grey8},
                                           {ARV_PIXEL_FORMAT_MONO_16, PixelFormat::grey16}}};

}  // namespace

void Check::or_throw(const std::string& what) const {
  if (error_ == nullptr) {
    return;
  }
  std::string text = what + ": " + error_->message;
  std::replace(text.begin(), text.end(), '\n', ' ');
  const bool silent =
      error_->domain == ARV_DEVICE_ERROR &&
      (error_->code == ARV_DEVICE_ERROR_TIMEOUT || error_->code == ARV_DEVICE_ERROR_NOT_CONNECTED ||
       error_->code == ARV_DEVICE_ERROR_PROTOCOL_ERROR || error_->code == ARV_DEVICE_ERROR_TRANSFER_ERROR ||
       error_->code == ARV_DEVICE_ERROR_NOT_FOUND || error_->code == ARV_DEVICE_ERROR_NOT_CONTROLLER);
  if (silent) {
    throw CameraFault(text);
  }
  throw InputError(text);
}

std::optional<PixelFormat> pixel_format_of(gint64 format) {
  for (const Pair& pair : kFormats) {
    if (pair.aravis == format) {
      return pair.ours;
    }
  }
  return std::nullopt;
}

std::optional<ArvPixelFormat> aravis_format_of(PixelFormat format) {
  for (const Pair& pair : kFormats) {
    if (pair.ours == format) {
      return pair.aravis;
    }
  }
  return std::nullopt;
}

}  // namespace lumigraft::aravis
