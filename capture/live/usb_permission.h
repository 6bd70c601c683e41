#pragma once
// Finds USB devices that this program has no permission to use; camera libraries silently ignore them.
#include <string>

namespace lumigraft::capture {

/// For a device named VENDOR/PRODUCT@BUS/ADDRESS as by OpenNI2's drivers; false for other names.
bool is_forbidden_usb_device(const std::string& uri);

/// Whether any forbidden device has an interface of this USB class and subclass.
bool is_forbidden_usb_interface(int interface_class, int subclass);

inline constexpr char kForbiddenUsb[] =
    "found no permission to use it, allowed: root and whom the rules of udev let use it";

}  // namespace lumigraft::capture
