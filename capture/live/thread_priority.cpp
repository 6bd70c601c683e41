#include "capture/live/thread_priority.h"

#include <sched.h>
#include <sys/resource.h>

#include "capture/live/parameters.h"

namespace lumigraft::capture {

constexpr int kThisThread = 0;  // Linux applies these calls to threads

ThreadPriority::ThreadPriority(int niceness) : before_(getpriority(PRIO_PROCESS, kThisThread)) {
  setpriority(PRIO_PROCESS, kThisThread, niceness);
}

ThreadPriority::~ThreadPriority() { setpriority(PRIO_PROCESS, kThisThread, before_); }

RealtimeScope::RealtimeScope() : policy_before_(sched_getscheduler(kThisThread)) {
  sched_param param{};
  sched_getparam(kThisThread, &param);
  priority_before_ = param.sched_priority;
  param.sched_priority = sched_get_priority_min(SCHED_RR);
  if (sched_setscheduler(kThisThread, SCHED_RR, &param) != 0) fallback_.emplace(kLiveParameters.fallback_niceness);
}

RealtimeScope::~RealtimeScope() {
  if (!fallback_) {
    sched_param param{};
    param.sched_priority = priority_before_;
    sched_setscheduler(kThisThread, policy_before_, &param);
  }
}

}  // namespace lumigraft::capture
