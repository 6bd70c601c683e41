#include "capture/live/aravis/library.h"

#include <algorithm>
#include <array>

#include "capture/live/usb_permission.h"

namespace lumigraft::capture::aravis {
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

std::string Check::text() const {
  std::string text = error_ != nullptr ? error_->message : "";
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

void Check::or_throw(const std::string& what) const {
  if (error_ == nullptr) {
    return;
  }
  // What the camera's own description of itself forbids stays forbidden; anything else, as a network that is not up
  // yet, may pass.
  const bool stays =
      error_->domain == ARV_GC_ERROR ||
      (error_->domain == ARV_DEVICE_ERROR &&
       (error_->code == ARV_DEVICE_ERROR_WRONG_FEATURE || error_->code == ARV_DEVICE_ERROR_FEATURE_NOT_FOUND ||
        error_->code == ARV_DEVICE_ERROR_INVALID_PARAMETER ||
        error_->code == ARV_DEVICE_ERROR_PROTOCOL_ERROR_INVALID_PARAMETER));
  if (stays) {
    throw InputError(what + ": " + text());
  }
  throw CameraFault(what + ": " + text());
}

bool usb3_vision_is_forbidden() {
  constexpr int kMiscellaneous = 0xEF, kUsb3Vision = 0x05;
  return is_forbidden_usb_interface(kMiscellaneous, kUsb3Vision);
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

}  // namespace lumigraft::capture::aravis
