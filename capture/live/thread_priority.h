#pragma once
// Scheduling priority of the calling thread for the lifetime of an object. Threads and processes started meanwhile
// inherit it.
#include <optional>

namespace lumigraft::capture {

/// Sets the niceness (man 7 sched).
class ThreadPriority {
 public:
  explicit ThreadPriority(int niceness);
  ~ThreadPriority();
  ThreadPriority(const ThreadPriority&) = delete;
  ThreadPriority& operator=(const ThreadPriority&) = delete;

 private:
  int before_;
};

/// Real-time scheduling (SCHED_RR, lowest priority) for short work that must not wait. If that is not permitted, a
/// higher niceness; if neither is, nothing changes.
class RealtimeScope {
 public:
  RealtimeScope();
  ~RealtimeScope();

 private:
  int policy_before_;
  int priority_before_ = 0;
  std::optional<ThreadPriority> fallback_;  ///< if SCHED_RR is not permitted
};

}  // namespace lumigraft::capture
