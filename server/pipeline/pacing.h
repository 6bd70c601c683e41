#pragma once
// Scheduling of stages, so that on few cores frames are rendered first and with low latency.
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace lumigraft::server {

using PaceClock = std::chrono::steady_clock;

/// False if stop was requested meanwhile.
inline bool sleep_until(PaceClock::time_point moment, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_until(lock, stop, moment, [] { return false; });
  return !stop.stop_requested();
}

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
/// of relight plus the usual duration of relight minus that of pose.
class LatencyScheduler {
 public:
  void relight_begins() { began_ = PaceClock::now().time_since_epoch().count(); }
  void relight_took(PaceClock::duration took) { relight_ = smoothed(relight_, took); }
  void pose_took(PaceClock::duration took) { pose_ = smoothed(pose_, took); }
  PaceClock::time_point pose_begins() const {
    const PaceClock::duration pose =
        PaceClock::duration(pose_) + PaceClock::duration(pose_) / 4;  // early by a margin: late would delay relight
    return PaceClock::time_point(PaceClock::duration(began_)) + PaceClock::duration(relight_) - pose;
  }

 private:
  static PaceClock::rep smoothed(PaceClock::rep before, PaceClock::duration now) { return (before + now.count()) / 2; }
  std::atomic<PaceClock::rep> began_ = 0, relight_ = 0, pose_ = 0;
};

}  // namespace lumigraft::server
