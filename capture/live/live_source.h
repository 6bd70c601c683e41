#pragma once
// A camera that may be absent, freeze, be unplugged and return. It runs on a thread of its own, so that opening,
// closing and waiting block no other camera; it is opened again until that succeeds.
//
// Frame times are on the host's clock, from the driver or from DeviceClock. While DeviceClock settles, the first four
// frames, or those of 0.2 s, are dropped. Sequence numbers continue after the camera was opened again, with a gap.
#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "capture/live/device_clock.h"
#include "capture/live/parameters.h"
#include "capture/source.h"

namespace lumigraft::capture {

struct LivePatience {
  std::chrono::milliseconds silence = kLiveParameters.silence;
  std::chrono::milliseconds retry = kLiveParameters.retry;
};

class LiveSource : public Source {
 public:
  using Open = std::function<std::unique_ptr<Source>()>;

  /// Tries once to open the camera before it returns. After a CameraFault, which may be temporary, it is tried again;
  /// an InputError, for example for a size that the camera does not offer, is thrown. `name` starts fault messages.
  LiveSource(std::string name, Open open, LivePatience patience = {});
  ~LiveSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override { return false; }
  void rewind() override {}
  std::string fault() const override;
  std::string take_warning() override;
  std::string serial() const override;

 private:
  using Clock = std::chrono::steady_clock;

  void run(const std::stop_token& stop);
  void read_frames(const std::stop_token& stop);
  void accept(SourceItem item);
  bool clock_settling();
  void set_fault(const std::string& fault);
  void wait_before_retry(const std::stop_token& stop);

  const std::string name_;
  const Open open_;
  const LivePatience patience_;
  // Used by the thread alone:
  std::unique_ptr<Source> device_;
  DeviceClock clock_;
  std::vector<SourceItem> bracket_;                         ///< incomplete bracket
  std::array<std::uint64_t, 3> first_sequence_{};           ///< by Stream: added to the device's numbers
  std::array<std::uint64_t, 3> next_sequence_{}, start_{};  ///< start_: next_sequence_ when the device was opened
  std::optional<Clock::time_point> settling_since_;
  int clock_frames_ = 0;  ///< frames since the device was opened, up to LiveParameters::clock_frames
  // Shared between threads:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<SourceItem> waiting_;
  std::string fault_, warning_, serial_;
  std::jthread thread_;
};

}  // namespace lumigraft::capture
