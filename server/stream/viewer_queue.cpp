#include "server/stream/viewer_queue.h"

#include "server/stream/parameters.h"

namespace lumigraft::server {

void ViewerQueue::want(Codec codec, StreamSize size) {
  if (size != size_) config_.reset();
  codec_ = codec;
  size_ = size;
  frames_.clear();
  needs_key_ = true;
  config_sent_ = false;
}

bool ViewerQueue::offer(std::shared_ptr<const StreamMessage> message, Clock::time_point now) {
  if (message->size != size_) return false;
  const StreamKind kind = message->header.kind;
  if (kind != StreamKind::config && codec_ == (kind == StreamKind::jpeg ? Codec::jpeg : Codec::h264))
    window_.made(message->header.sequence, now);
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

std::optional<ViewerQueue::Outgoing> ViewerQueue::next_text() {
  for (const char* kind : {"hello", "error", "saved", "state", "stats"}) {
    if (auto found = texts_.find(kind); found != texts_.end()) {
      Outgoing out = std::move(found->second);
      texts_.erase(found);
      return out;
    }
  }
  return std::nullopt;
}

std::optional<ViewerQueue::Outgoing> ViewerQueue::next(Clock::time_point now) {
  if (std::optional<Outgoing> text = next_text()) return text;
  if (frames_.empty() || window_.full(now)) return std::nullopt;
  if (frames_.front()->header.kind == StreamKind::h264_key && config_ && !config_sent_) {
    config_sent_ = true;
    return config_;
  }
  auto frame = std::move(frames_.front());
  frames_.pop_front();
  window_.sent(frame->header.sequence, now);
  return frame;
}

}  // namespace lumigraft::server
