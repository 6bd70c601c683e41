#pragma once
// Records a session's folder: session.toml with the calibration of the cameras, and one Matroska file per stream. The
// folder can be replayed at any time, even if the recording is interrupted.
//
// Different streams may be written by different threads, each stream by one thread.
#include <array>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "capture/record/stream_recorder.h"
#include "capture/session/session.h"

namespace lumigraft::capture {

class SessionRecorder {
 public:
  /// `folder` must be new or empty, else InputError is thrown. Files that the session names are copied.
  SessionRecorder(const SessionText& text, const Session& session, std::filesystem::path folder,
                  DepthCoding coding = DepthCoding::ffv1);

  /// As StreamRecorder::write.
  bool write(Stream stream, const SourceItem& item);

  /// Ends the recording and compresses uncompressed depth to FFV1. The compressed file replaces the other one when it
  /// is complete, so the session replays the same even if this is interrupted. Returns soon after `stop`. Throws as
  /// write.
  void compress_depth(const std::stop_token& stop);

 private:
  void write_session_text();

  SessionText text_;
  std::string name_;
  std::array<std::string, 3> serials_;  ///< by Stream
  std::filesystem::path folder_;
  std::optional<StreamSpec> uncompressed_depth_;
  std::array<std::unique_ptr<StreamRecorder>, 3> streams_;  ///< by Stream; null if the session has none
  std::mutex mutex_;
  std::array<bool, 3> seen_{};             ///< streams with at least one frame
  std::optional<double> color_readout_s_;  ///< that the colour camera reports
};

}  // namespace lumigraft::capture
