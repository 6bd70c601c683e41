#pragma once
// Priority of geometry, lamp tags, light and albedo.
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <mutex>
#include <vector>

#include "server/pipeline/parameters.h"

namespace lumigraft::server {

/// Threads of lower priority than rendering.
class BackgroundThreads {
 public:
  /// Adds the calling thread.
  void add() {
    const auto thread = static_cast<id_t>(syscall(SYS_gettid));
    std::lock_guard lock(mutex_);
    threads_.push_back(thread);
    setpriority(PRIO_PROCESS, thread, kPipeline.background_niceness);
  }
  /// Restores the normal priority where the system permits it. The last thread of a process frees its memory when it
  /// ends, which on a busy machine takes seconds at low priority.
  void restore_priority() {
    std::lock_guard lock(mutex_);
    for (const id_t thread : threads_) {
      setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, static_cast<id_t>(getpid())));
    }
    threads_.clear();
  }

 private:
  std::mutex mutex_;
  std::vector<id_t> threads_;
};

}  // namespace lumigraft::server
