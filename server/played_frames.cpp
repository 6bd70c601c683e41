#include "server/played_frames.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace lumigraft {
namespace {

constexpr std::chrono::milliseconds kPatience{100};
/// Further behind than this, a recording goes on from now instead of catching up in a burst.
constexpr std::chrono::milliseconds kTooLate{500};

std::size_t bytes_of(const Picture& picture) {
  return picture.encoded.data.size() + sizeof(float) * picture.radiance.data.size() +
         (picture.original ? picture.original->bytes.size() : 0);
}

std::size_t bytes_of(const FrameSet& frame) {
  std::size_t bytes = bytes_of(*frame.color);
  if (frame.depth) {
    bytes += sizeof(float) * frame.depth->depth_m.data.size();
  }
  for (const auto& picture : frame.fisheye) {
    bytes += bytes_of(*picture);
  }
  return bytes;
}

}  // namespace

PlayedFrames::PlayedFrames(std::unique_ptr<FrameReader> reader, std::size_t memory_bytes)
    : reader_(std::move(reader)), memory_left_(memory_bytes) {}

std::shared_ptr<const FrameSet> PlayedFrames::read() {
  if (from_memory_) {
    return position_ < kept_.size() ? kept_[position_] : nullptr;
  }
  std::optional<FrameSet> set = reader_->next(kPatience);
  if (!set) {
    return nullptr;
  }
  auto frame = std::make_shared<const FrameSet>(std::move(*set));
  if (!reader_->live() && round_ == 0 && all_kept_) {
    const std::size_t bytes = bytes_of(*frame);
    if (bytes <= memory_left_) {
      memory_left_ -= bytes;
      kept_.push_back(frame);
    } else {
      all_kept_ = false;
      kept_.clear();
    }
  }
  return frame;
}

bool PlayedFrames::begin_again() {
  if (position_ == 0) {
    return false;
  }
  from_memory_ = all_kept_;
  if (!from_memory_) {
    reader_->rewind();
  }
  position_ = 0;
  ++round_;
  return true;
}

bool PlayedFrames::wait_until_due(const FrameSet& frame, const std::stop_token& stop) {
  const Clock::time_point now = Clock::now();
  if (round_ == 0 && position_ == 0) {
    due_ = now;
  } else if (position_ == 0) {
    due_ += usual_gap_;
  } else {
    usual_gap_ = std::chrono::nanoseconds(std::max<std::int64_t>(frame.time_ns - last_time_ns_, 1'000'000));
    due_ += usual_gap_;
  }
  last_time_ns_ = frame.time_ns;
  if (now > due_ + kTooLate) {
    due_ = now;
  }
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_until(lock, stop, due_, [] { return false; });
  return !stop.stop_requested();
}

std::optional<PlayedFrame> PlayedFrames::next(const std::stop_token& stop) {
  std::shared_ptr<const FrameSet> frame = read();
  if (!frame && !reader_->live() && (from_memory_ || reader_->finished())) {
    if (!begin_again()) {
      gone_ = true;
      return std::nullopt;
    }
    frame = read();
  }
  if (!frame) {
    return std::nullopt;
  }
  PlayedFrame played{frame, Clock::now(), round_};
  if (!reader_->live()) {
    if (!wait_until_due(*frame, stop)) {
      return std::nullopt;
    }
    played.captured = due_;
  } else if (const std::int64_t host_ns = frame->color->stamp.host_time_ns; host_ns > 0) {
    played.captured = Clock::time_point(std::chrono::nanoseconds(host_ns));
  }
  ++position_;
  return played;
}

}  // namespace lumigraft
