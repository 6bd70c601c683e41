#include "server/pipeline/frame_player.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lumigraft::server {
namespace {

std::size_t bytes_of(const capture::Frame& picture) {
  return picture.encoded.data.size() + sizeof(float) * picture.radiance.data.size() +
         (picture.original ? picture.original->bytes.size() : 0);
}

std::size_t bytes_of(const capture::FrameSet& frame) {
  std::size_t bytes = bytes_of(*frame.color);
  if (frame.raw_depth) bytes += sizeof(std::uint16_t) * frame.raw_depth->counts.data.size();
  for (const auto& picture : frame.fisheye) bytes += bytes_of(*picture);
  return bytes;
}

}  // namespace

FramePlayer::FramePlayer(std::unique_ptr<capture::FrameReader> reader, std::size_t memory_bytes, PlayClock clock)
    : reader_(std::move(reader)),
      seekable_(dynamic_cast<capture::SeekableReader*>(reader_.get())),
      memory_bytes_(memory_bytes),
      clock_(std::move(clock)),
      length_ns_(seekable_ != nullptr ? seekable_->length_ns().value_or(0) : 0) {}

std::shared_ptr<const capture::FrameSet> FramePlayer::read() {
  if (from_memory_) return position_ < kept_.size() ? kept_[position_] : nullptr;
  std::optional<capture::FrameSet> set = reader_->next(kPipeline.patience);
  if (!set) return nullptr;
  auto frame = std::make_shared<const capture::FrameSet>(std::move(*set));
  if (!reader_->live() && all_kept_) {
    kept_bytes_ += bytes_of(*frame);
    too_large_ = kept_bytes_ > memory_bytes_;
    all_kept_ = !too_large_;
    if (all_kept_) {
      kept_.push_back(frame);
    } else {
      kept_.clear();
    }
  }
  return frame;
}

void FramePlayer::seek(std::int64_t from_ns) {
  if (from_memory_) {
    const auto time_ns = [&](const auto& frame) { return frame->time_ns - first_time_ns_; };
    position_ = static_cast<std::size_t>(std::ranges::lower_bound(kept_, from_ns, {}, time_ns) - kept_.begin());
  } else if (seekable_ != nullptr) {
    seekable_->seek(from_ns);
    kept_.clear();
    all_kept_ = false;
  } else {
    return;
  }
  jumped_ = true;
  ++round_;
}

bool FramePlayer::begin_again() {
  if (position_ == 0 && !jumped_) return false;
  from_memory_ = from_memory_ || all_kept_;
  if (!from_memory_) {
    seekable_ != nullptr ? seekable_->seek(0) : reader_->rewind();
    all_kept_ = !too_large_;
    kept_bytes_ = 0;
  }
  position_ = 0;
  jumped_ = false;
  ++round_;
  return true;
}

/// False: the frame is late and to be skipped.
bool FramePlayer::due(const capture::FrameSet& frame) {
  const std::int64_t before_ns = std::exchange(last_time_ns_, frame.time_ns);
  if (jumped_ || !newest_) {
    pace_.begin(clock_.now());
    return true;
  }
  return pace_.shows(position_ == 0 ? pace_.gap() : std::chrono::nanoseconds(frame.time_ns - before_ns), clock_.now());
}

/// The next frame of this round or of the next one.
std::shared_ptr<const capture::FrameSet> FramePlayer::read_round() {
  std::shared_ptr<const capture::FrameSet> frame = read();
  if (frame || reader_->live() || (!from_memory_ && !reader_->finished())) return frame;
  if (begin_again()) return read();
  gone_ = true;
  return nullptr;
}

/// The newest frame again, with a later time.
std::optional<PlayedFrame> FramePlayer::repeat_newest(const std::stop_token& stop) {
  pace_.repeat(clock_.now());
  repeated_ns_ += std::chrono::nanoseconds(pace_.gap()).count();
  auto again = std::make_shared<capture::FrameSet>(*newest_);
  again->time_ns += repeated_ns_;
  again->warnings.clear();
  return clock_.sleep_until(pace_.due(), stop) ? std::optional(PlayedFrame{std::move(again), pace_.due(), round_})
                                               : std::nullopt;
}

std::optional<PlayedFrame> FramePlayer::next(const std::stop_token& stop, const Playback::Orders& orders) {
  if (newest_ && orders.at_s) seek(std::llround(1e9 * *orders.at_s));
  if (newest_ && orders.paused && !orders.step && !jumped_) return repeat_newest(stop);
  if (repeated_ns_ > 0) {
    repeated_ns_ = 0;
    ++round_;  // the next frame's time is earlier than that of the last repeated one
  }
  std::shared_ptr<const capture::FrameSet> frame = read_round();
  std::vector<std::shared_ptr<const capture::Frame>> fisheye;  // of skipped frames: light has another pace
  while (frame && !reader_->live() && !due(*frame)) {
    if (!frame->fisheye.empty()) fisheye = frame->fisheye;
    length_ns_ = std::max(length_ns_, frame->time_ns - first_time_ns_);
    ++position_;
    frame = read_round();
  }
  if (!frame) return std::nullopt;
  PlayedFrame played{frame, clock_.now(), round_};
  if (!reader_->live()) {
    if (!clock_.sleep_until(pace_.due(), stop)) return std::nullopt;
    played.captured = pace_.due();
    first_time_ns_ = newest_ ? first_time_ns_ : frame->time_ns;
    length_ns_ = std::max(length_ns_, frame->time_ns - first_time_ns_);
    newest_ = frame;
    jumped_ = false;
    if (frame->fisheye.empty() && !fisheye.empty()) {
      auto with_fisheye = std::make_shared<capture::FrameSet>(*frame);
      with_fisheye->fisheye = std::move(fisheye);
      played.frame = std::move(with_fisheye);
    }
  } else if (const std::int64_t host_ns = frame->color->stamp.host_time_ns; host_ns > 0) {
    played.captured = Clock::time_point(std::chrono::nanoseconds(host_ns));
  }
  ++position_;
  return played;
}

}  // namespace lumigraft::server
