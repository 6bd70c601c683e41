#pragma once
// Handles SIGINT, SIGTERM and SIGHUP in a program with many threads, including those of libraries.
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>

namespace lumigraft::server {

/// Construct before any other thread: threads inherit the signal mask. Lives as long as the process. Before arm(), a
/// signal ends the process at once with exit code 0: nothing needs an orderly shutdown at start-up, and compiling
/// shaders or loading models cannot be interrupted otherwise. After arm(), a signal allows `save_patience` until
/// saved() is called, then `stop_patience` for an orderly shutdown, and then ends the process, also with exit code 0. A
/// second signal ends it at once.
class StopSignal {
 public:
  /// With `reloads`, SIGHUP asks for the configuration to be read again; else it ends the process as it does by
  /// default.
  explicit StopSignal(bool reloads = false);

  void arm();
  /// True when a signal to stop has arrived. Returns early for SIGHUP, too.
  bool wait(std::chrono::milliseconds timeout);
  /// Whether SIGHUP has arrived since the last call.
  bool take_reload();
  /// Call after a signal arrived, when all is written that must not be lost.
  void saved();

 private:
  void wait_for_stop(const sigset_t& all);
  void came();
  void end_process(const sigset_t& signals);

  std::mutex mutex_;
  std::condition_variable changed_;
  bool armed_ = false, came_ = false, saved_ = false, reload_ = false;
};

}  // namespace lumigraft::server
