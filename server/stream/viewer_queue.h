#pragma once
// The bounded send queue of one viewer. JPEG keeps the newest frame only; an H.264 queue that overflows skips to the
// next key frame, so a slow viewer does not delay the others. Uses no sockets and no clock; used by one thread.
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/stream/ack_window.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

class ViewerQueue {
 public:
  using Clock = std::chrono::steady_clock;
  using Outgoing = std::variant<std::string, std::shared_ptr<const StreamMessage>>;

  void want(Codec codec, StreamSize size = StreamSize::full);
  Codec codec() const { return codec_; }
  StreamSize size() const { return size_; }

  /// Queues the frame if this viewer requests its kind. True when this or an older frame was dropped.
  bool offer(std::shared_ptr<const StreamMessage> message, Clock::time_point now);
  /// Whether a key frame could be sent now, and nothing else. Who stands still asks for none: a key frame costs all.
  bool wants_key(Clock::time_point now) { return codec_ == Codec::h264 && needs_key_ && !window_.full(now); }
  /// Whether a picture that is encoded now would be sent at once.
  bool ready(Clock::time_point now) { return frames_.empty() && !window_.full(now); }
  void network_trip(Clock::duration trip) { window_.network_trip(trip); }
  /// Replaces the queued text of the same kind ("hello", "state", "stats", "error", "saved").
  void offer_text(const std::string& kind, std::string text) { texts_[kind] = std::move(text); }
  /// False where this frame was not sent to this viewer, or was acknowledged before.
  bool acknowledge(std::uint32_t sequence, Clock::time_point now) { return window_.acknowledged(sequence, now); }

  /// The next message to send: text before frames.
  std::optional<Outgoing> next(Clock::time_point now);
  std::optional<Outgoing> next_text();

 private:
  bool offer_frame(std::shared_ptr<const StreamMessage> message);

  Codec codec_ = Codec::none;
  StreamSize size_ = StreamSize::full;
  std::map<std::string, std::string> texts_;
  std::deque<std::shared_ptr<const StreamMessage>> frames_;
  std::shared_ptr<const StreamMessage> config_;  ///< the newest; sent before the next key frame
  bool config_sent_ = false;
  bool needs_key_ = true;
  AckWindow window_;
};

}  // namespace lumigraft::server
