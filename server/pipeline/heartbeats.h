#pragma once
// Heartbeats of threads that run a loop: one in each iteration, also while it waits for input. A thread without one is
// in a call that does not return, as of a device that hangs.
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace lumigraft::server {

class Heartbeats {
 public:
  using Clock = std::chrono::steady_clock;

  /// Beats for the first time when the thread begins.
  void beat(const std::string& thread, Clock::time_point now = Clock::now()) {
    std::lock_guard lock(mutex_);
    last_[thread] = now;
  }
  /// The thread has ended.
  void forget(const std::string& thread) {
    std::lock_guard lock(mutex_);
    last_.erase(thread);
  }
  /// The thread that has not beaten for longest, if that is `limit` or more.
  std::optional<std::string> hung(Clock::duration limit, Clock::time_point now = Clock::now()) const {
    std::lock_guard lock(mutex_);
    std::optional<std::string> found;
    Clock::time_point earliest = now - limit;
    for (const auto& [thread, last] : last_) {
      if (last > earliest) continue;
      earliest = last;
      found = thread;
    }
    return found;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Clock::time_point> last_;
};

}  // namespace lumigraft::server
