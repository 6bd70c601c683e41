#pragma once
// What the USB has and this program may not use: libraries of cameras pass over it as if it were not there.
#include <string>

namespace lumigraft::capture {

/// The device that drivers of OpenNI2 call VENDOR/PRODUCT@BUS/ADDRESS; other names are none of the USB.
bool is_forbidden_usb_device(const std::string& uri);

/// Some device with an interface of this class and subclass, as the USB's own codes are.
bool is_forbidden_usb_interface(int interface_class, int subclass);

inline constexpr char kForbiddenUsb[] =
    "found no permission to use it, allowed: root and whom the rules of udev let use it";

}  // namespace lumigraft::capture
