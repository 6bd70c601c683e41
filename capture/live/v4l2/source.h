#pragma once
// v4l2:[CAMERA] - a Video4Linux camera, for example a webcam or frame grabber, given by node, name under
// /dev/v4l/by-id, card name or bus; the first one if no name is given.
//
// A frame grabber uses the input that the session names or the selected one, takes frame size and rate from a digital
// signal, and is opened again if the signal changes.
//
// Exposure, gain and white balance are fixed. Frames are read from the driver's buffers without a copy, except if rows
// are padded, planes are separate, or the driver would have too few buffers left. Times are the driver's. A fish-eye
// may take the exposures of a bracket in turn; the frames of a bracket have one time and an exposure each.
#include <string>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class V4l2Source : public ForwardingSource {
 public:
  /// Throws CameraFault if the camera is absent, in use or forbidden, InputError if it does not offer what the session
  /// requires.
  V4l2Source(const std::string& camera, const StreamSpec& spec);

 private:
  class Camera;
};

}  // namespace lumigraft::capture
