#pragma once
// The bounded send queue of one viewer. JPEG keeps the newest frame only; an H.264 queue that overflows skips to the
// next key frame, so a slow viewer does not delay the others. Uses no sockets and no clock; used by one thread.
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/stream/parameters.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

class ViewerQueue {
 public:
  using Outgoing = std::variant<std::string, std::shared_ptr<const StreamMessage>>;

  void want(Codec codec);
  Codec codec() const { return codec_; }

  /// Queues the frame if this viewer requests its kind. True when this or an older frame was dropped.
  bool offer(std::shared_ptr<const StreamMessage> message);
  /// Replaces the queued text of the same kind ("hello", "state", "stats", "error").
  void offer_text(const std::string& kind, std::string text) { texts_[kind] = std::move(text); }
  /// False where this frame was not sent to this viewer, or was acknowledged before.
  bool acknowledge(std::uint32_t sequence);

  /// The next message to send: text before frames.
  std::optional<Outgoing> next();
  std::optional<Outgoing> next_text();

 private:
  bool owes_acknowledgements() const { return acknowledges_ && under_way_.size() >= kStream.max_in_flight; }
  bool offer_frame(std::shared_ptr<const StreamMessage> message);

  Codec codec_ = Codec::none;
  std::map<std::string, std::string> texts_;
  std::deque<std::shared_ptr<const StreamMessage>> frames_;
  std::shared_ptr<const StreamMessage> config_;  ///< the newest; sent before the next key frame
  bool config_sent_ = false;
  bool needs_key_ = true;
  bool acknowledges_ = false;
  std::deque<std::uint32_t>
      under_way_;                ///< sequence numbers sent and not acknowledged; bounded, the oldest are dropped
  std::uint32_t held_back_ = 0;  ///< frames offered while too many were unacknowledged
};

}  // namespace lumigraft::server
