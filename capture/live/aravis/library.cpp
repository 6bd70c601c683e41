#include "capture/live/aravis/library.h"

#include <algorithm>
#include <array>

#include "capture/live/usb_permission.h"
#include "capture/message_text.h"

namespace lumigraft::capture::aravis {
namespace {

struct FormatPair {
  ArvPixelFormat aravis;
  PixelFormat format;
};

constexpr std::array<FormatPair, 10> kFormats = {{{ARV_PIXEL_FORMAT_BAYER_RG_8, PixelFormat::bayer_rggb8},
                                                  {ARV_PIXEL_FORMAT_BAYER_BG_8, PixelFormat::bayer_bggr8},
                                                  {ARV_PIXEL_FORMAT_BAYER_GB_8, PixelFormat::bayer_gbrg8},
                                                  {ARV_PIXEL_FORMAT_BAYER_GR_8, PixelFormat::bayer_grbg8},
                                                  {ARV_PIXEL_FORMAT_RGB_8_PACKED, PixelFormat::rgb8},
                                                  {ARV_PIXEL_FORMAT_BGR_8_PACKED, PixelFormat::bgr8},
                                                  {ARV_PIXEL_FORMAT_MONO_8, PixelFormat::grey8},
                                                  {ARV_PIXEL_FORMAT_MONO_10, PixelFormat::grey10},
                                                  {ARV_PIXEL_FORMAT_MONO_12, PixelFormat::grey12},
                                                  {ARV_PIXEL_FORMAT_MONO_16, PixelFormat::grey16}}};

struct FreeMemory {
  void operator()(gpointer p) const { g_free(p); }
};

}  // namespace

std::string Check::text() const { return on_one_line(error_ != nullptr ? error_->message : ""); }

/// Other errors, for example of a network that is not up yet, may be temporary.
bool Check::permanent() const {
  return error_ == nullptr || error_->domain == ARV_GC_ERROR ||
         (error_->domain == ARV_DEVICE_ERROR &&
          (error_->code == ARV_DEVICE_ERROR_WRONG_FEATURE || error_->code == ARV_DEVICE_ERROR_FEATURE_NOT_FOUND ||
           error_->code == ARV_DEVICE_ERROR_INVALID_PARAMETER ||
           error_->code == ARV_DEVICE_ERROR_PROTOCOL_ERROR_INVALID_PARAMETER));
}

void Check::or_throw(const std::string& what) const {
  if (error_ == nullptr) return;
  if (permanent()) throw InputError(what + ": " + text());
  throw CameraFault(what + ": " + text());
}

bool usb3_vision_is_forbidden() {
  constexpr int kMiscellaneous = 0xEF, kUsb3Vision = 0x05;  // class and subclass of the USB3 Vision standard
  return is_forbidden_usb_interface(kMiscellaneous, kUsb3Vision);
}

std::vector<gint64> pixel_formats_of(ArvCamera* camera) {
  Check check;
  guint count = 0;
  const std::unique_ptr<gint64, FreeMemory> formats(arv_camera_dup_available_pixel_formats(camera, &count, check));
  check.or_throw("pixel formats");
  return {formats.get(), formats.get() + count};
}

std::vector<std::string> entries_of(ArvCamera* camera, const std::string& feature, Check& check) {
  guint count = 0;
  const std::unique_ptr<const char*, FreeMemory> entries(
      arv_camera_dup_available_enumerations_as_strings(camera, feature.c_str(), &count, check));
  return entries ? std::vector<std::string>(entries.get(), entries.get() + count) : std::vector<std::string>();
}

std::optional<PixelFormat> pixel_format_of(gint64 format) {
  const auto* found = std::ranges::find(kFormats, format, &FormatPair::aravis);
  return found != kFormats.end() ? std::optional(found->format) : std::nullopt;
}

std::optional<ArvPixelFormat> aravis_format_of(PixelFormat format) {
  const auto* found = std::ranges::find(kFormats, format, &FormatPair::format);
  return found != kFormats.end() ? std::optional(found->aravis) : std::nullopt;
}

}  // namespace lumigraft::capture::aravis
