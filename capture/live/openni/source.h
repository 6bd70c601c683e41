#pragma once
// openni2:[URI] - a depth camera that OpenNI2 knows. One object delivers colour and depth. A device runs without
// mirroring and with fixed exposure and white balance, at the spec's `rate_hz` and `gain`; `controls.exposure` is in
// the device's own unit, which OpenNI2 does not know.
//
// Also what OpenNI2's recorder wrote, in a process that may crash (oni_source.h): stepped picture by picture, never
// sought (OpenNI2 2.2 crashes), its times starting at 0.
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class OpenNiSource : public Source {
 public:
  enum class Kind { recording, device };

  /// `uri` is a file's path, a device's URI, or empty for any device. `silence` is how long no picture of a recording
  /// comes where its counts do not say that it is over. Throws InputError.
  OpenNiSource(Kind kind, const std::string& uri, const std::vector<StreamSpec>& specs,
               std::chrono::milliseconds silence = std::chrono::milliseconds(5000));
  ~OpenNiSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override {}
  std::string serial() const override;

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
};

}  // namespace lumigraft::capture
