#pragma once
// A camera that may be absent, fall silent, be unplugged and come back. It lives on a thread of its own, so that
// opening, closing or waiting for it holds up nobody else, and it is opened again for as long as it takes.
//
// Its pictures carry the host's clock, by the driver's word or by DeviceClock, whose first four, of two tenths of a
// second at most, are kept back; and numbers that go on after it came back, with a gap.
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
#include "capture/source.h"

namespace lumigraft::capture {

struct LivePatience {
  std::chrono::milliseconds silence{2000};  ///< without a picture a camera counts as frozen and is opened again
  std::chrono::milliseconds retry{500};     ///< between two tries to open it
};

class LiveSource : public Source {
 public:
  using Open = std::function<std::unique_ptr<Source>()>;

  /// Opens the camera once before it returns. A CameraFault is trouble that may pass; what no patience mends, as a size
  /// it does not offer, throws InputError. `name` begins what it says of trouble.
  LiveSource(std::string name, Open open, LivePatience patience = {});
  ~LiveSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override { return false; }
  void rewind() override {}
  std::string fault() const override;
  std::string take_warning() override;
  std::string serial() const override;

 private:
  void run(const std::stop_token& stop);
  void listen(const std::stop_token& stop);
  void accept(SourceItem item);
  bool learns_its_clock();
  void say(const std::string& fault);
  void rest(const std::stop_token& stop);

  const std::string name_;
  const Open open_;
  const LivePatience patience_;
  // Of the thread alone:
  std::unique_ptr<Source> device_;
  DeviceClock clock_;
  std::vector<SourceItem> bracket_;                         ///< not yet whole
  std::array<std::uint64_t, 3> first_sequence_{};           ///< by Stream, of this run of the device
  std::array<std::uint64_t, 3> next_sequence_{}, start_{};  ///< start_: as next_sequence_ was when it was opened
  std::optional<std::chrono::steady_clock::time_point> learning_since_;
  int learnt_from_ = 0;  ///< pictures of this run, up to as many as tell how its clock stands
  // Shared:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<SourceItem> waiting_;
  std::string trouble_, warning_, serial_;
  std::jthread thread_;
};

}  // namespace lumigraft::capture
