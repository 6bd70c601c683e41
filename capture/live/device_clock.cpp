#include "capture/live/device_clock.h"

#include <algorithm>

#include "capture/live/parameters.h"

namespace lumigraft::capture {

std::int64_t DeviceClock::to_host(std::int64_t device_ns, std::int64_t host_ns) {
  constexpr std::int64_t kWindow_ns = kLiveParameters.clock_window_ns;
  constexpr std::int64_t kJump_ns = kLiveParameters.clock_jump_ns;
  // The second stream of the same exposure: a window that begins between the two must not change the result.
  if (device_ns == last_device_ns_ && host_ns < last_arrival_ns_ + kWindow_ns) return last_host_ns_;
  // Unsigned, since device times may have any value: differences wrap without undefined behaviour.
  const auto offset_ns =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(host_ns) - static_cast<std::uint64_t>(device_ns));
  const std::int64_t known_ns = std::min(smallest_ns_, smallest_before_ns_);
  const bool jumped = known_ns != kNone && (offset_ns < known_ns - kJump_ns || offset_ns > known_ns + kJump_ns);
  if (jumped || host_ns >= window_end_ns_) {
    smallest_before_ns_ = jumped ? kNone : smallest_ns_;
    smallest_ns_ = kNone;
    window_end_ns_ = host_ns + kWindow_ns;
  }
  smallest_ns_ = std::min(smallest_ns_, offset_ns);
  last_device_ns_ = device_ns;
  last_arrival_ns_ = host_ns;
  last_host_ns_ = host_ns - (offset_ns - std::min(smallest_ns_, smallest_before_ns_));
  return last_host_ns_;
}

}  // namespace lumigraft::capture
