#pragma once
// A device's clock on this host's: cameras whose clocks have nothing in common are paired on the host's.
//
// A picture arrives some time after its moment, never before. The smallest (arrival - device time) of the last seconds
// is therefore the clocks' offset plus the shortest way, which hardly changes, however much single arrivals jitter (the
// lower envelope of Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements",
// 1999, in windows short enough to follow the drift of quartz).
#include <cstdint>
#include <limits>

namespace lumigraft::capture {

class DeviceClock {
 public:
  /// The host's time of a picture that carries `device_ns` and arrived at `host_ns`; never after its arrival. A clock
  /// that jumps is followed at once. What is told again within a second gets the same time again.
  std::int64_t to_host(std::int64_t device_ns, std::int64_t host_ns);

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  std::int64_t window_end_ns_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t smallest_ns_ = kNone;         ///< of this window
  std::int64_t smallest_before_ns_ = kNone;  ///< of the one before
  std::int64_t last_device_ns_ = 0, last_host_ns_ = 0;
  std::int64_t last_arrival_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  ///< of the last picture: long ago
};

}  // namespace lumigraft::capture
