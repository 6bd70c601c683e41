#pragma once
// Converts device time to host time, so that cameras with unrelated clocks can be paired.
//
// A frame arrives after its time of exposure, with a delay that varies. The minimum of (arrival - device time) over the
// last seconds is the offset of the clocks plus the smallest delay, which hardly changes even if single arrivals jitter
// (lower envelope: Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements",
// 1999; in windows short enough to follow the drift of quartz clocks).
#include <cstdint>
#include <limits>

namespace lumigraft::capture {

class DeviceClock {
 public:
  /// Host time of a frame with device time `device_ns` that arrived at `host_ns`; never after its arrival. A jump of
  /// the device clock is followed at once. The same `device_ns` again within a second gives the same result.
  std::int64_t to_host(std::int64_t device_ns, std::int64_t host_ns);

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  std::int64_t window_end_ns_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t smallest_ns_ = kNone;         ///< offset, in the current window
  std::int64_t smallest_before_ns_ = kNone;  ///< offset, in the previous window
  std::int64_t last_device_ns_ = 0, last_host_ns_ = 0;
  std::int64_t last_arrival_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  ///< initially long ago
};

}  // namespace lumigraft::capture
