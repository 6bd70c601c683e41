#pragma once
// The size of the stream that a viewer gets: the one that it asked for, else the larger one unless its network does not
// carry that. The larger one is tried again after a while, and each time after twice as long.
//
// No clock: times are given. One thread.
#include <chrono>
#include <optional>

#include "server/stream/parameters.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

class SizeChoice {
 public:
  using Clock = std::chrono::steady_clock;

  void ask(std::optional<StreamSize> size);
  /// `network_too_slow`: for the size that the viewer gets now.
  StreamSize choose(bool network_too_slow, Clock::time_point now);

 private:
  std::optional<StreamSize> asked_;
  StreamSize size_ = StreamSize::full;
  Clock::time_point since_{};
  Clock::duration retry_after_ = kStream.first_retry;
};

}  // namespace lumigraft::server
