#pragma once
// The page's record button: records live cameras as a session while the service runs, on its own threads.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "capture/record/recording_lanes.h"
#include "capture/record/source_observer.h"

namespace lumigraft::server {

class RecordButton {
 public:
  enum class Doing { nothing, recording, finishing, compressing };
  struct State {
    Doing doing = Doing::nothing;
    double seconds = 0.0;                ///< duration of the running or newest recording
    std::string folder;                  ///< its folder; empty before the first
    std::uint64_t frames = 0, lost = 0;  ///< over all streams
    std::string error;                   ///< the error that ended it; empty on success
  };

  /// Each recording is a new folder in `folder`, named by its start time.
  RecordButton(capture::SessionText text, capture::Session session, std::filesystem::path folder,
               capture::SourceObserver& tap);
  ~RecordButton();  ///< ends the recording

  /// Starts or stops recording and returns at once; errors are in the state. No effect where that is already so or a
  /// recording is being finished. Starting aborts the compression of the previous recording's depth, which stays
  /// uncompressed.
  void press(bool on);
  /// Also ends a recording that failed, for example on a full disk.
  State state();

 private:
  using Clock = std::chrono::steady_clock;

  void end();
  void count();

  const capture::SessionText text_;
  const capture::Session session_;
  const std::filesystem::path folder_;
  capture::SourceObserver& tap_;
  std::mutex mutex_;
  State state_;
  Clock::time_point began_;
  std::shared_ptr<capture::RecordingLanes> lanes_;  ///< while recording or finishing
  std::atomic<bool> compressing_ = false;
  std::jthread finisher_;
};

}  // namespace lumigraft::server
