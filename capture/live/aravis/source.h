#pragma once
// aravis:[CAMERA] - a GigE Vision or USB3 Vision camera through Aravis, named by its ID, serial number's ID or address;
// the first one where no name is given.
//
// Exposure, gain and white balance are fixed. A picture whose packets did not all come, after they were asked for
// again, is lost and never shown. Times are the camera's own: those of chunks, with the exposure and gain that each
// picture had, where the camera has such; else those of the pictures' leaders. One copy is made of what the driver
// holds.
#include <string>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class AravisSource : public Source {
 public:
  /// Throws CameraFault where the camera does not answer, InputError where it does not offer what the session wants.
  AravisSource(const std::string& camera, const StreamSpec& spec);
  ~AravisSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override {}
  std::string take_warning() override;

 private:
  class Camera;
  std::unique_ptr<Camera> camera_;
};

}  // namespace lumigraft::capture
