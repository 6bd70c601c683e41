#include "relight/gpu/hang.h"

#include <algorithm>

namespace lumigraft::relight::gpu {

bool ends_within(std::chrono::milliseconds limit, const std::function<bool(std::chrono::nanoseconds)>& ended) {
  while (true) {
    const std::chrono::milliseconds slice = std::min(limit, kWait_slice);
    if (ended(slice)) return true;
    if (limit == kNever_hangs) continue;
    limit -= slice;
    if (limit.count() <= 0) return false;
  }
}

}  // namespace lumigraft::relight::gpu
