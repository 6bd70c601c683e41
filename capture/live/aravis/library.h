#pragma once
// Aravis' errors, pointers and pixel formats. Included by .cpp files alone.
#include <arv.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/error.h"
#include "capture/formats/pixel_format.h"

namespace lumigraft::capture::aravis {

struct Unref {
  void operator()(gpointer p) const { g_object_unref(p); }
};
template <typename T>
using Ref = std::unique_ptr<T, Unref>;

/// Receives the error of a call. or_throw() throws a CameraFault for errors that may be temporary, else an InputError.
class Check {
 public:
  Check() = default;
  ~Check() { g_clear_error(&error_); }
  Check(const Check&) = delete;
  Check& operator=(const Check&) = delete;

  operator GError**() {
    g_clear_error(&error_);
    return &error_;
  }
  bool failed() const { return error_ != nullptr; }
  std::string text() const;  ///< on one line; empty without an error
  bool permanent() const;    ///< what the camera's description does not allow, or no error
  void or_throw(const std::string& what) const;

 private:
  GError* error_ = nullptr;
};

/// Whether there is a USB3 Vision camera without permission, which Aravis silently ignores.
bool usb3_vision_is_forbidden();

/// Pixel formats that the camera offers, of any kind. Throws as Check::or_throw.
std::vector<gint64> pixel_formats_of(ArvCamera* camera);
/// Entries of an enumeration among the camera's features that can be chosen now.
std::vector<std::string> entries_of(ArvCamera* camera, const std::string& feature, Check& check);

std::optional<PixelFormat> pixel_format_of(gint64 format);
std::optional<ArvPixelFormat> aravis_format_of(PixelFormat format);

}  // namespace lumigraft::capture::aravis
