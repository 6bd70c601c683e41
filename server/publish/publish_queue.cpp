#include "server/publish/publish_queue.h"

#include <utility>

#include "server/publish/parameters.h"

namespace lumigraft::server {

std::size_t PublishQueue::offer(Picture message, Clock::time_point now) {
  const bool key = message->header.kind == StreamKind::h264_key;
  if (!key && message->header.kind != StreamKind::h264_delta) return 0;
  std::size_t dropped = 0;
  if (!waiting_.empty() && now - waiting_.front().since > kPublish.max_wait) {
    dropped = waiting_.size();
    restart();
  }
  if (needs_key_ && !key) return dropped + 1;
  needs_key_ = false;
  waiting_.push_back({std::move(message), now});
  return dropped;
}

PublishQueue::Picture PublishQueue::take() {
  if (waiting_.empty()) return nullptr;
  Picture picture = std::move(waiting_.front().picture);
  waiting_.pop_front();
  return picture;
}

void PublishQueue::restart() {
  waiting_.clear();
  needs_key_ = true;
}

}  // namespace lumigraft::server
