#pragma once
// What waits to be sent to one viewer. Bounded: the newest picture wins, and H.264 skips to the next key picture, so a
// slow viewer costs nobody anything. No socket and no clock in here; one thread uses it.
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/stream/protocol.h"

namespace lumigraft::server {

class ViewerQueue {
 public:
  static constexpr std::size_t kLongestRun = 8;       ///< H.264 pictures that wait
  static constexpr std::uint32_t kMostUnderWay = 16;  ///< pictures sent and not acknowledged, once a viewer does so

  using Outgoing = std::variant<std::string, std::shared_ptr<const StreamMessage>>;

  void want(Codec codec);
  Codec codec() const { return codec_; }

  /// Takes the picture if this viewer wants its kind; true when an older one or this one was dropped for it.
  bool offer(std::shared_ptr<const StreamMessage> message);
  /// Text of one kind replaces what of that kind still waits ("hello", "state", "stats", "error").
  void offer_text(const std::string& kind, std::string text);
  /// False where this viewer was not sent that picture, or said so before.
  bool acknowledge(std::uint32_t sequence);

  /// What to send next: text first, then pictures.
  std::optional<Outgoing> next();
  std::optional<Outgoing> next_text();

 private:
  bool owes_acknowledgements() const { return acknowledges_ && under_way_.size() >= kMostUnderWay; }
  bool offer_picture(std::shared_ptr<const StreamMessage> message);

  Codec codec_ = Codec::none;
  std::map<std::string, std::string> texts_;
  std::deque<std::shared_ptr<const StreamMessage>> pictures_;
  std::shared_ptr<const StreamMessage> config_;  ///< the newest, to go before the next key picture
  bool config_sent_ = false;
  bool needs_key_ = true;
  bool acknowledges_ = false;
  std::deque<std::uint32_t> under_way_;  ///< sequences sent and not acknowledged; the oldest go beyond a bound
  std::uint32_t held_back_ = 0;          ///< pictures made while the viewer owed acknowledgements
};

}  // namespace lumigraft::server
