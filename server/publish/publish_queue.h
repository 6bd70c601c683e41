#pragma once
// Pictures between the encoder and the thread that publishes them. Bounded in time: where the oldest has waited too
// long all are dropped, and the stream continues with the next key frame. Uses no clock and no lock.
#include <chrono>
#include <deque>
#include <memory>

#include "server/stream/protocol.h"

namespace lumigraft::server {

class PublishQueue {
 public:
  using Clock = std::chrono::steady_clock;
  using Picture = std::shared_ptr<const StreamMessage>;

  /// Returns the number of pictures that were dropped, this one included. Only H.264 is published: others are ignored.
  std::size_t offer(Picture message, Clock::time_point now);
  /// Whether a key frame must come before any other picture.
  bool needs_key() const { return needs_key_; }
  /// Null where there is none.
  Picture take();
  /// Discards all; the next picture is a key frame.
  void restart();

 private:
  struct Waiting {
    Picture picture;
    Clock::time_point since;
  };
  std::deque<Waiting> waiting_;
  bool needs_key_ = true;
};

}  // namespace lumigraft::server
