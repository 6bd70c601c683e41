#pragma once
// Frames as a live camera would bring them, whether they come from one or from a recording: at their own pace, a
// recording over and over again. A recording that fits in memory is decoded once.
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture/source.h"

namespace lumigraft {

struct PlayedFrame {
  std::shared_ptr<const FrameSet> frame;
  std::chrono::steady_clock::time_point captured;  ///< when it was there, or due
  std::uint64_t round = 0;                         ///< how often the recording began again
};

class PlayedFrames {
 public:
  static constexpr std::size_t kMemory_bytes = std::size_t{512} << 20;

  explicit PlayedFrames(std::unique_ptr<FrameReader> reader, std::size_t memory_bytes = kMemory_bytes);

  /// Waits until the next frame is due. Empty: stopped, or nothing came for a while and the caller asks again.
  std::optional<PlayedFrame> next(const std::stop_token& stop);

  /// A recording gave no frame in a whole round.
  bool gone() const { return gone_; }
  /// What keeps live cameras from giving pictures: FrameReader::troubles.
  std::vector<std::string> troubles() const { return reader_->troubles(); }

 private:
  std::shared_ptr<const FrameSet> read();
  bool begin_again();
  bool wait_until_due(const FrameSet& frame, const std::stop_token& stop);

  using Clock = std::chrono::steady_clock;
  std::unique_ptr<FrameReader> reader_;
  std::size_t memory_left_;
  std::vector<std::shared_ptr<const FrameSet>> kept_;
  bool all_kept_ = true;  ///< what was read so far is in memory
  bool from_memory_ = false;
  std::size_t position_ = 0;  ///< frames given in this round
  std::uint64_t round_ = 0;
  bool gone_ = false;
  std::int64_t last_time_ns_ = 0;  ///< recorded time of the frame before
  Clock::time_point due_{};        ///< when that one was due
  Clock::duration usual_gap_ = std::chrono::milliseconds(33);
};

}  // namespace lumigraft
