#pragma once
// Handles SIGINT and SIGTERM in a program with many threads, including those of libraries.
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace lumigraft::server {

/// Construct before any other thread: threads inherit the signal mask. Lives as long as the process. Before arm(), a
/// signal ends the process at once with exit code 0: nothing needs an orderly shutdown at start-up, and compiling
/// shaders or loading models cannot be interrupted otherwise. After arm(), a signal allows `stop_patience` for an
/// orderly shutdown and then ends the process, also with exit code 0.
class StopSignal {
 public:
  StopSignal();

  void arm();
  /// True when a signal has arrived.
  bool wait(std::chrono::milliseconds timeout);

 private:
  void came();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool armed_ = false, came_ = false;
};

}  // namespace lumigraft::server
