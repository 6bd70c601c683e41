#pragma once
// libcamera:[CAMERA] - a camera that libcamera drives, for example behind the image processors of phones and laptops,
// or a webcam, given by ID or model; the first one if no name is given.
//
// libcamera runs in a helper process (messages.h), since it aborts when a camera is unplugged. Exposure, gain and white
// balance are fixed; if the camera reports the exposure of each frame, it is used. Times are the sensor's, on the
// host's clock. Frames are read from the driver's buffers without a copy, except if rows are padded, planes are
// separate, or the driver would have too few buffers left.
#include <sys/types.h>

#include <string>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class LibcameraSource : public ForwardingSource {
 public:
  /// Throws CameraFault if the camera is absent or in use, InputError if it does not offer what the session requires.
  LibcameraSource(const std::string& camera, const StreamSpec& spec);
  pid_t process() const;  ///< the helper

 private:
  class Camera;
};

}  // namespace lumigraft::capture
