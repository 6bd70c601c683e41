#include "server/stream/size_choice.h"

#include <algorithm>

namespace lumigraft::server {

void SizeChoice::ask(std::optional<StreamSize> size) {
  asked_ = size;
  size_ = size.value_or(StreamSize::full);
  retry_after_ = kStream.first_retry;
}

StreamSize SizeChoice::choose(bool network_too_slow, Clock::time_point now) {
  if (asked_) return *asked_;
  if (size_ == StreamSize::full && network_too_slow) {
    // What went well for long says more than what failed before.
    if (now - since_ >= retry_after_) retry_after_ = kStream.first_retry;
    size_ = StreamSize::half;
    since_ = now;
  } else if (size_ == StreamSize::half && now - since_ >= retry_after_) {
    retry_after_ = std::min<Clock::duration>(2 * retry_after_, kStream.last_retry);
    size_ = StreamSize::full;
    since_ = now;
  }
  return size_;
}

}  // namespace lumigraft::server
