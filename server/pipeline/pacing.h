#pragma once
// When stages should work, so that on few cores the picture comes first and is young.
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>

namespace lumigraft::server {

using PaceClock = std::chrono::steady_clock;

/// A stage that runs behind keeps to its rate, and rests some times as long as it kept a core busy: its share of a core
/// is bounded also where a busy machine stretches its work. Nothing is put before it while it works or rests: it would
/// lie there and be old.
class DutyCycle {
 public:
  explicit DutyCycle(PaceClock::duration every) : every_(every) {}

  /// Any thread.
  bool over(int times) const { return !at_work_ && PaceClock::now() >= ends(times); }
  /// When it is over, if it does not work now. Any thread.
  PaceClock::time_point ends(int times) const {
    return PaceClock::time_point(PaceClock::duration(ended_) + std::max(every_, times * PaceClock::duration(worked_)));
  }
  void begin() {
    began_ = cpu_time();
    at_work_ = true;
  }
  /// On the thread that began.
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
  /// Long ago at first: the clock may have started with the machine, a moment before.
  std::atomic<PaceClock::rep> ended_ = PaceClock::duration::min().count() / 2, worked_ = 0;
  std::atomic<bool> at_work_ = false;
};

/// Work from here to the end of the block, whatever is thrown.
class ScopedWork {
 public:
  explicit ScopedWork(DutyCycle& rest) : rest_(rest) { rest_.begin(); }
  ~ScopedWork() { rest_.end(); }
  ScopedWork(const ScopedWork&) = delete;
  ScopedWork& operator=(const ScopedWork&) = delete;

 private:
  DutyCycle& rest_;
};

/// When pose should begin, so that its frame is ready just as relight comes free, and not a whole picture older: after
/// relight began, by its usual duration less that of pose.
class LatencyScheduler {
 public:
  void relight_begins() { began_ = PaceClock::now().time_since_epoch().count(); }
  void relight_took(PaceClock::duration took) { relight_ = smoothed(relight_, took); }
  void pose_took(PaceClock::duration took) { pose_ = smoothed(pose_, took); }
  PaceClock::time_point pose_begins() const {
    const PaceClock::duration pose =
        PaceClock::duration(pose_) + PaceClock::duration(pose_) / 4;  // rather early than late
    return PaceClock::time_point(PaceClock::duration(began_)) + PaceClock::duration(relight_) - pose;
  }

 private:
  static PaceClock::rep smoothed(PaceClock::rep before, PaceClock::duration now) { return (before + now.count()) / 2; }
  std::atomic<PaceClock::rep> began_ = 0, relight_ = 0, pose_ = 0;
};

}  // namespace lumigraft::server
