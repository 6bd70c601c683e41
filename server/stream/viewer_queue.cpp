#include "server/stream/viewer_queue.h"

#include <algorithm>

namespace lumigraft::server {

void ViewerQueue::want(Codec codec) {
  codec_ = codec;
  frames_.clear();
  needs_key_ = true;
  config_sent_ = false;
}

bool ViewerQueue::offer(std::shared_ptr<const StreamMessage> message) {
  // A viewer that loses frames on its side never acknowledges them: after max_in_flight more frames the count restarts.
  if (owes_acknowledgements() && ++held_back_ >= kStream.max_in_flight) {
    under_way_.clear();
    held_back_ = 0;
  }
  return offer_frame(std::move(message));
}

bool ViewerQueue::offer_frame(std::shared_ptr<const StreamMessage> message) {
  const StreamKind kind = message->header.kind;
  if (kind == StreamKind::config) {
    config_ = std::move(message);
    config_sent_ = false;
    return false;
  }
  if (codec_ != (kind == StreamKind::jpeg ? Codec::jpeg : Codec::h264)) return false;
  if (kind != StreamKind::h264_delta) {
    const bool dropped = !frames_.empty();
    frames_.clear();
    frames_.push_back(std::move(message));
    needs_key_ = false;
    return dropped;
  }
  if (needs_key_) return true;
  if (frames_.size() >= kStream.max_queued) {
    frames_.clear();
    needs_key_ = true;
    return true;
  }
  frames_.push_back(std::move(message));
  return false;
}

bool ViewerQueue::acknowledge(std::uint32_t sequence) {
  acknowledges_ = true;
  const auto known = std::find(under_way_.begin(), under_way_.end(), sequence);
  if (known == under_way_.end()) return false;
  under_way_.erase(under_way_.begin(), known + 1);  // earlier frames were skipped by the viewer
  held_back_ = 0;
  return true;
}

std::optional<ViewerQueue::Outgoing> ViewerQueue::next_text() {
  for (const char* kind : {"hello", "error", "state", "stats"}) {
    if (auto found = texts_.find(kind); found != texts_.end()) {
      Outgoing out = std::move(found->second);
      texts_.erase(found);
      return out;
    }
  }
  return std::nullopt;
}

std::optional<ViewerQueue::Outgoing> ViewerQueue::next() {
  if (std::optional<Outgoing> text = next_text()) return text;
  if (frames_.empty() || owes_acknowledgements()) return std::nullopt;
  if (frames_.front()->header.kind == StreamKind::h264_key && config_ && !config_sent_) {
    config_sent_ = true;
    return config_;
  }
  auto frame = std::move(frames_.front());
  frames_.pop_front();
  under_way_.push_back(frame->header.sequence);
  if (under_way_.size() > kStream.max_in_flight) under_way_.pop_front();
  return frame;
}

}  // namespace lumigraft::server
