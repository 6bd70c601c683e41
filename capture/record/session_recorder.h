#pragma once
// A session's folder while it is being recorded: session.toml with the calibration of the cameras it came from, and a
// Matroska file for each stream. It can be replayed at any moment, whatever ends the recording.
//
// Streams may be written by different threads, each stream by one.
#include <array>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "capture/record/stream_recorder.h"
#include "capture/session/session.h"
#include "capture/session/session_text.h"

namespace lumigraft::capture {

class SessionRecorder {
 public:
  /// `folder` is new or empty; else throws InputError. Files that the session names are copied.
  SessionRecorder(const SessionText& text, const Session& session, std::filesystem::path folder,
                  DepthCoding coding = DepthCoding::ffv1);

  /// As StreamRecorder::write.
  bool write(Stream stream, const SourceItem& item);

  /// Ends the recording. Depth that was kept uncompressed becomes FFV1, in its place once it is whole: whatever ends
  /// this, the session replays the same. Returns soon after `stop`. Throws as write.
  void compress_depth(const std::stop_token& stop);

 private:
  void write_session_text();

  SessionText text_;
  std::string name_;
  std::array<std::string, 3> serials_;  ///< by Stream
  std::filesystem::path folder_;
  std::optional<StreamSpec> uncompressed_depth_;
  std::array<std::unique_ptr<StreamRecorder>, 3> streams_;  ///< by Stream; null where the session has none
  std::mutex mutex_;
  std::array<bool, 3> seen_{};  ///< streams that have a picture
};

}  // namespace lumigraft::capture
