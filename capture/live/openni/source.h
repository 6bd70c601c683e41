#pragma once
// openni2:[URI] - a depth camera supported by OpenNI2. One object delivers colour and depth. Devices run without
// mirroring and with fixed exposure and white balance, at the spec's `rate_hz` and `gain`; `controls.exposure` is in
// the device's own unit, which OpenNI2 does not report.
//
// Also reads OpenNI2's recordings, in a helper process (oni_source.h): frame by frame without seeking, which crashes
// OpenNI2 2.2; times start at 0.
#include <chrono>
#include <string>
#include <vector>

#include "capture/live/parameters.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class OpenNiSource : public ForwardingSource {
 public:
  enum class Kind { recording, device };

  /// `uri` is a file's path, a device's URI, or empty for any device. After `silence` without a frame, a recording
  /// whose frame counts are wrong has ended. Throws InputError.
  OpenNiSource(Kind kind, const std::string& uri, const std::vector<StreamSpec>& specs,
               std::chrono::milliseconds silence = kOpenNiParameters.recording_silence);

 private:
  class Reader;
};

}  // namespace lumigraft::capture
