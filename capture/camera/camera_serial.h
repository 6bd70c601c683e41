#pragma once
// What tells a camera from others of its kind: a calibration holds for one of them.
#include <string>

#include "capture/error.h"

namespace lumigraft::capture {

/// What a source's URI says of which camera it is. aravis:NAME is a camera's own name, and v4l2:usb-NAME-video-indexN
/// what udev made of its maker, model and serial number. Empty where the URI names a place (a bus, a port, a node), any
/// camera, or a recording.
inline std::string serial_in(const std::string& source) {
  const std::string name = source.substr(source.find(':') + 1);
  if (source.starts_with("aravis:")) {
    return name;
  }
  const std::string node = name.substr(name.rfind('/') + 1);
  const bool by_id = node.starts_with("usb-") && node.find("-video-index") != std::string::npos;
  return source.starts_with("v4l2:") && by_id ? node : "";
}

/// Throws InputError where a camera says that it is another one than the session or its calibration is for. Either may
/// be empty: not known.
inline void check_serial(const std::string& found, const std::string& allowed) {
  if (!found.empty() && !allowed.empty() && found != allowed) {
    throw InputError("found the camera with the serial number \"" + found + "\", allowed: \"" + allowed +
                     "\", which the session or its calibration is for");
  }
}

}  // namespace lumigraft::capture
