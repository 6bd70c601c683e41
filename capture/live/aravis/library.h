#pragma once
// What both users of Aravis need: its errors and its words. Included by .cpp files alone.
#include <arv.h>

#include <memory>
#include <optional>
#include <string>

#include "capture/error.h"
#include "capture/formats/pixel_format.h"

namespace lumigraft::capture::aravis {

struct Unref {
  void operator()(gpointer p) const { g_object_unref(p); }
};
template <typename T>
using Ref = std::unique_ptr<T, Unref>;

struct FreeMemory {
  void operator()(gpointer p) const { g_free(p); }
};

/// Takes an error out of a call; throws it as what it is: a camera that does not answer may do so later.
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
  std::string text() const;  ///< on one line; empty where nothing failed
  void or_throw(const std::string& what) const;

 private:
  GError* error_ = nullptr;
};

/// Of a camera of USB3 Vision that this program may not use Aravis says nothing.
bool usb3_vision_is_forbidden();

std::optional<PixelFormat> pixel_format_of(gint64 format);
std::optional<ArvPixelFormat> aravis_format_of(PixelFormat format);

}  // namespace lumigraft::capture::aravis
