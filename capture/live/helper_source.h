#pragma once
// A camera that a program of its own drives and gives frames of (docs/helpers.md): freenect:, and helper: for programs
// of others.
#include "capture/live/helper_frames.h"

namespace lumigraft::capture {

class HelperSource : public Source {
 public:
  /// As HelperFrames; also throws InputError for a camera with another serial number than the session's.
  HelperSource(const std::string& program, std::vector<std::string> arguments, const std::vector<StreamSpec>& specs);
  /// helper:PROGRAM [ARGUMENT ...], with single spaces between. Throws InputError if there is no such program.
  HelperSource(const std::string& command, const std::vector<StreamSpec>& specs);

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override { return frames_.next(timeout); }
  bool finished() const override { return frames_.ended(); }
  void rewind() override {}
  std::string fault() const override;
  std::string take_warning() override { return frames_.take_warning(); }
  std::string serial() const override { return frames_.serial(); }

 private:
  HelperFrames frames_;
};

}  // namespace lumigraft::capture
