#pragma once
// Scheduling of stages, so that on few cores frames are rendered first and with low latency.
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>

#include "server/metrics/usual_duration.h"

namespace lumigraft::server {

using PaceClock = std::chrono::steady_clock;

/// False if stop was requested meanwhile.
inline bool sleep_until(PaceClock::time_point moment, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_until(lock, stop, moment, [] { return false; });
  return !stop.stop_requested();
}

/// The time and the waiting of who plays a recording; tests have another.
struct PlayClock {
  std::function<PaceClock::time_point()> now = [] { return PaceClock::now(); };
  /// False if stop was requested meanwhile.
  std::function<bool(PaceClock::time_point, const std::stop_token&)> sleep_until =
      [](PaceClock::time_point moment, const std::stop_token& stop) { return server::sleep_until(moment, stop); };
};

/// Duty cycle of a background stage: it keeps a minimum interval, and rests for a multiple of the processor time that
/// it used, so its fraction of a core is bounded even if a busy machine prolongs its work. No input is queued while it
/// works or rests, because it would be outdated when it is taken.
class DutyCycle {
 public:
  explicit DutyCycle(PaceClock::duration every) : every_(every) {}

  /// Any thread.
  bool over(int times) const { return !at_work_ && PaceClock::now() >= ends(times); }
  /// When the rest ends if the stage does not work now. Any thread.
  PaceClock::time_point ends(int times) const {
    return PaceClock::time_point(PaceClock::duration(ended_) + std::max(every_, times * PaceClock::duration(worked_)));
  }
  void begin() {
    began_ = cpu_time();
    at_work_ = true;
  }
  /// On the thread that called begin().
  void end() {
    worked_ = (cpu_time() - began_).count();
    ended_ = PaceClock::now().time_since_epoch().count();
    at_work_ = false;
  }

 private:
  static PaceClock::duration cpu_time() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
  }

  const PaceClock::duration every_;
  PaceClock::duration began_{};
  /// Initially long past: the clock may have started with the machine, only just before.
  std::atomic<PaceClock::rep> ended_ = PaceClock::duration::min().count() / 2, worked_ = 0;
  std::atomic<bool> at_work_ = false;
};

/// Marks work from its construction to the end of the block.
class ScopedWork {
 public:
  explicit ScopedWork(DutyCycle& rest) : rest_(rest) { rest_.begin(); }
  ~ScopedWork() { rest_.end(); }
  ScopedWork(const ScopedWork&) = delete;
  ScopedWork& operator=(const ScopedWork&) = delete;

 private:
  DutyCycle& rest_;
};

/// When pose should begin so that its frame is ready when relight becomes free, not up to one frame earlier: the begin
/// of relight plus the usual duration of relight minus that of pose, and at once where relight is free. Any thread.
class LatencyScheduler {
 public:
  void relight_begins(PaceClock::time_point now = PaceClock::now()) {
    const std::lock_guard lock(mutex_);
    began_ = now;
    busy_ = true;
  }
  void relight_ends(PaceClock::time_point now = PaceClock::now()) {
    {
      const std::lock_guard lock(mutex_);
      relight_.add(now - began_);
      busy_ = false;
    }
    ended_.notify_all();
  }
  void pose_took(PaceClock::duration took) {
    const std::lock_guard lock(mutex_);
    pose_.add(took);
  }
  /// In the past where relight is free.
  PaceClock::time_point pose_begins() const {
    const std::lock_guard lock(mutex_);
    return begins();
  }
  /// False if stop was requested meanwhile.
  bool wait_for_pose(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    ended_.wait_until(lock, stop, begins(), [this] { return !busy_; });
    return !stop.stop_requested();
  }
  /// The same, but until relight is free, or so long.
  bool wait_for_relight(PaceClock::duration at_most, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    ended_.wait_for(lock, stop, at_most, [this] { return !busy_; });
    return !stop.stop_requested();
  }

 private:
  PaceClock::time_point begins() const {
    if (!busy_) return PaceClock::time_point::min();
    // Early by a margin: late would delay relight.
    return began_ + relight_.usual() - pose_.usual() - pose_.usual() / 4;
  }

  mutable std::mutex mutex_;
  std::condition_variable_any ended_;
  bool busy_ = false;
  PaceClock::time_point began_{};
  UsualDuration relight_, pose_;
};

}  // namespace lumigraft::server
