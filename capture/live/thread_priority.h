#pragma once
// How a thread stands to others that want the processor too, for as long as one of these lives; threads and programs
// that it begins meanwhile start with it.
#include <optional>

namespace lumigraft::capture {

/// The calling thread's niceness, as `man 7 sched` has it.
class ThreadPriority {
 public:
  explicit ThreadPriority(int wanted);
  ~ThreadPriority();
  ThreadPriority(const ThreadPriority&) = delete;
  ThreadPriority& operator=(const ThreadPriority&) = delete;

 private:
  int before_;
};

/// Goes before all that is not urgent: for work that is little and must not wait. Where the system lets nobody do so
/// the thread stays as it is.
class RealtimeScope {
 public:
  RealtimeScope();
  ~RealtimeScope();
  RealtimeScope(const RealtimeScope&) = delete;
  RealtimeScope& operator=(const RealtimeScope&) = delete;

 private:
  int policy_before_;
  int priority_before_ = 0;
  std::optional<ThreadPriority> instead_;  ///< where only that is allowed
};

}  // namespace lumigraft::capture
