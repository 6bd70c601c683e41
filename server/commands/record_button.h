#pragma once
// The page's record button: what live cameras give becomes a session beside the picture, behind its threads.
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
    double seconds = 0.0;                  ///< of the running or newest recording
    std::string folder;                    ///< of it; empty before the first
    std::uint64_t pictures = 0, lost = 0;  ///< of all streams
    std::string error;                     ///< what ended it; empty where it went well
  };

  /// Recordings become folders in `folder`, named by the time.
  RecordButton(capture::SessionText text, capture::Session session, std::filesystem::path folder,
               capture::SourceObserver& tap);
  ~RecordButton();  ///< ends a recording first

  /// Returns at once; what goes wrong is in the state. Nothing happens where it is so already, or one is being
  /// finished. One whose depth is being compressed stays as it is: the new one goes before.
  void press(bool on);
  /// Also ends a recording that failed, as on a full disk.
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
