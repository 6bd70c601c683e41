#pragma once
// aravis:[CAMERA] - a GigE Vision or USB3 Vision camera through Aravis, given by its ID, the ID of its serial number or
// its address; the first one if no name is given.
//
// Exposure, gain and white balance are fixed. A frame with missing packets, after they were requested again, is lost.
// Times are the camera's: from chunks, together with exposure and gain of each frame, if the camera has them; else from
// the leader of each frame. Frames are copied once from the driver's buffer.
#include <string>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class AravisSource : public ForwardingSource {
 public:
  /// Throws CameraFault if the camera does not answer, InputError if it does not offer what the session requires.
  AravisSource(const std::string& camera, const StreamSpec& spec);

 private:
  class Camera;
};

}  // namespace lumigraft::capture
