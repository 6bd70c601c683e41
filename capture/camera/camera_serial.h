#pragma once
// Serial numbers: a calibration is valid for one camera only.
#include <string>

#include "capture/error.h"

namespace lumigraft::capture {

/// The unique camera name that a source URI contains: NAME of aravis:NAME, or v4l2:usb-NAME-video-indexN, which udev
/// makes from vendor, model and serial number. Empty if the URI names a bus, port or node, any camera, or a recording.
inline std::string serial_in(const std::string& source) {
  const std::string name = source.substr(source.find(':') + 1);
  if (source.starts_with("aravis:")) return name;
  const std::string node = name.substr(name.rfind('/') + 1);
  const bool by_id = node.starts_with("usb-") && node.find("-video-index") != std::string::npos;
  return source.starts_with("v4l2:") && by_id ? node : "";
}

/// Throws InputError if the serial numbers differ. Either may be empty: not known.
inline void check_serial(const std::string& found, const std::string& allowed) {
  refuse_if(!found.empty() && !allowed.empty() && found != allowed,
            "found the camera with the serial number \"" + found + "\", allowed: \"" + allowed +
                "\", which the session or its calibration is for");
}

}  // namespace lumigraft::capture
