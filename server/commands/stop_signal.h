#pragma once
// SIGINT and SIGTERM for a program with many threads, some of them of libraries.
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace lumigraft::server {

/// Make it before any other thread: they inherit that these signals are not theirs. Lives as long as the process.
/// Until `armed`, a signal ends the process at once with exit code 0: at start-up nothing needs an orderly end, and
/// compiling shaders or loading models cannot be cut short otherwise. After that a signal leaves `kPatience` for an
/// orderly end and then ends the process with exit code 0 as well.
class StopSignal {
 public:
  static constexpr std::chrono::milliseconds kPatience{250};

  StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  void arm();
  /// True when a signal came, now or before.
  bool wait(std::chrono::milliseconds timeout);

 private:
  void came();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool armed_ = false, came_ = false;
};

}  // namespace lumigraft::server
