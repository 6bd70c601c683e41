#pragma once
// Waits for a device that may hang, as after a command that never ends or a bus error.
//
// A device whose work does not end within the limit is abandoned: DeviceHung is thrown by the wait and by every later
// use of it. It may still write to its memory, and its driver may wait for it in any call. Therefore nothing of it is
// freed, on purpose: destructors of its objects leave driver and memory alone, and the process keeps them until it
// ends. Whoever makes a new device after that has to bound how often. A call into the driver that does not return, as a
// submission to a kernel driver that is stuck, is not such a wait: only a watchdog of the process ends it.
#include <chrono>
#include <functional>

namespace lumigraft::relight::gpu {

/// Of hardware: drivers of Linux reset a GPU after 2 to 10 s in one submission, so that none needs longer to work, and
/// the thread that waits has time left until a watchdog of 10 s.
inline constexpr std::chrono::milliseconds kHardware_hangs_after{8000};
/// Software devices are threads of this process, which cannot hang apart from it, and take as long as the machine is
/// busy.
inline constexpr std::chrono::milliseconds kNever_hangs = std::chrono::milliseconds::max();

inline constexpr std::chrono::milliseconds kWait_slice{250};

/// Calls `ended(slice)`, which waits for a slice at most, until it is true; false if it is not within `limit`. Slices
/// are counted instead of time: a process that was stopped meanwhile, or a machine that was suspended, loses one slice.
bool ends_within(std::chrono::milliseconds limit, const std::function<bool(std::chrono::nanoseconds)>& ended);

}  // namespace lumigraft::relight::gpu
