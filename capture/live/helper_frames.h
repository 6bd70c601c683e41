#pragma once
// Reads frames from a helper program (helper_messages.h). Only those of the requested streams and sizes are accepted.
#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "capture/descriptor.h"
#include "capture/live/helper_messages.h"
#include "capture/live/helper_process.h"
#include "capture/live/reported_exposure.h"
#include "capture/source.h"

namespace lumigraft::capture {

class HelperFrames {
 public:
  /// Runs `program` with these arguments and the words of each stream (docs/helpers.md), and waits until it has opened
  /// its camera or file. Throws CameraFault or InputError with the helper's reason; CameraFault if it does not answer
  /// within `patience`, or ends.
  HelperFrames(const std::string& program, std::vector<std::string> arguments, const std::vector<StreamSpec>& specs,
               std::chrono::milliseconds patience);

  /// Empty: the timeout is over, or the helper has ended. It may take `patience` for the rest of a message.
  std::optional<SourceItem> next(std::chrono::milliseconds timeout);
  bool ended() const { return ended_; }
  /// After it has ended: why, one line; empty if it ended normally.
  const std::string& end_reason() const { return end_reason_; }
  const std::string& serial() const { return serial_; }
  std::string take_warning();

 private:
  struct Pipe {
    Descriptor read_end, write_end;
  };
  static Pipe open_pipe();
  std::optional<HelperMessage> receive_message(std::chrono::milliseconds timeout);
  bool receive(std::span<std::uint8_t> bytes);
  std::string receive_text(const HelperMessage& message);
  std::optional<SourceItem> receive_frame(const HelperMessage& message, const Stamp& stamp);
  void end(const std::string& why);

  std::vector<StreamSpec> specs_;
  std::chrono::milliseconds patience_;
  Pipe pipe_;
  HelperProcess process_;
  std::vector<ReportedExposure> exposures_;  ///< of each stream
  bool ended_ = false;
  std::string end_reason_, serial_;
};

}  // namespace lumigraft::capture
