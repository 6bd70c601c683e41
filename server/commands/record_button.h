#pragma once
// The page's record button: records live cameras as a session while the service runs, on its own threads: who presses
// it waits for no disk.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "capture/record/recording_lanes.h"
#include "capture/record/source_observer.h"
#include "server/commands/recordings_folder.h"

namespace lumigraft::server {

class RecordButton {
 public:
  enum class Doing { nothing, starting, recording, finishing, compressing };
  struct State {
    Doing doing = Doing::nothing;
    double seconds = 0.0;                ///< duration of the running or newest recording
    std::string folder;                  ///< its folder; empty before the first
    std::uint64_t frames = 0, lost = 0;  ///< over all streams
    std::string error;                   ///< what ended it, for viewers; empty where that was the button
  };

  /// Each recording is a new folder in `folder`, named by its start time. `folder` keeps its limits while recording; a
  /// recording ends after `max_s`.
  RecordButton(capture::SessionText text, capture::Session session, RecordingsFolder folder, double max_s,
               capture::SourceObserver& tap);
  ~RecordButton();  ///< ends the recording

  /// Starts or stops recording and returns at once; errors are in the state. No effect where that is already so or a
  /// recording is being finished. Starting aborts the compression of the previous recording's depth, which stays
  /// uncompressed.
  void press(bool on);
  State state();

 private:
  using Clock = std::chrono::steady_clock;

  void run(const std::stop_token& stop);
  void start();
  void end(const std::string& reason, bool compress);
  void check();
  void count();
  void fail(const std::string& reason);

  const capture::SessionText text_;
  const capture::Session session_;
  const RecordingsFolder folder_;
  const double max_s_;
  capture::SourceObserver& tap_;
  // Shared between threads:
  std::mutex mutex_;
  std::condition_variable_any pressed_;
  State state_;
  bool end_wanted_ = false;
  Clock::time_point began_;
  std::shared_ptr<capture::RecordingLanes> lanes_;  ///< while recording or finishing
  std::atomic<bool> compressing_ = false;
  std::jthread finisher_;  ///< used by worker_ only
  std::jthread worker_;
};

}  // namespace lumigraft::server
