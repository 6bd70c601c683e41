#pragma once
// v4l2:[CAMERA] - a camera of the kernel's Video4Linux, as webcams and frame grabbers: its node, its name under
// /dev/v4l/by-id, its card's name or bus; the first one where no name is given.
//
// A frame grabber stays at its chosen input or takes the one that the session names, follows the signal that is plugged
// into a digital one, and is opened anew where that changes.
//
// Exposure, gain and white balance are fixed. Pictures are read where the driver put them; none is copied but those
// whose rows are padded or in two pieces, and those that are kept for longer than the driver can spare. Times are the
// driver's. A fish-eye may take the exposures of a bracket in turn; its pictures carry one time, and each its own
// exposure.
#include <string>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class V4l2Source : public Source {
 public:
  /// Throws CameraFault where the camera is not there or not ours, InputError where it does not offer what the session
  /// wants.
  V4l2Source(const std::string& camera, const StreamSpec& spec);
  ~V4l2Source() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override {}
  std::string fault() const override;
  bool on_host_clock() const override;
  bool bracket_incomplete() const override;

 private:
  class Camera;
  std::unique_ptr<Camera> camera_;
};

}  // namespace lumigraft::capture
