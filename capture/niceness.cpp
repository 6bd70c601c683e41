#include "capture/niceness.h"

#include <sys/resource.h>

namespace lumigraft {

constexpr id_t kThisThread = 0;  // Linux counts niceness by thread

Niceness::Niceness(int wanted) : before_(getpriority(PRIO_PROCESS, kThisThread)) {
  setpriority(PRIO_PROCESS, kThisThread, wanted);
}

Niceness::~Niceness() { setpriority(PRIO_PROCESS, kThisThread, before_); }

}  // namespace lumigraft
