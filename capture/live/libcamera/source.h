#pragma once
// libcamera:[CAMERA] - a camera that libcamera drives, as those of phones' and laptops' image processors, and webcams:
// its ID or its model; the first one where no name is given.
//
// libcamera runs in a process of its own (libcamera_messages.h), since it aborts where a camera is unplugged. Exposure,
// gain and white balance are fixed; where the camera says with what a picture was really taken, the picture's exposure
// follows it. Times are the sensor's, on the host's clock. Pictures are read where the driver put them; none is copied
// but those whose rows are padded or in two pieces, and those that are kept for longer than the driver can spare.
#include <sys/types.h>

#include <string>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class LibcameraSource : public Source {
 public:
  /// Throws CameraFault where the camera is not there or somebody else's, InputError where it does not offer what the
  /// session wants.
  LibcameraSource(const std::string& camera, const StreamSpec& spec);
  ~LibcameraSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override {}
  std::string fault() const override;
  std::string serial() const override;
  bool on_host_clock() const override { return true; }

  pid_t process() const;  ///< that libcamera runs in

 private:
  class Camera;
  std::unique_ptr<Camera> camera_;
};

}  // namespace lumigraft::capture
