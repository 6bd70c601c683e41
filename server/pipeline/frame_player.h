#pragma once
// Frames as a live camera would bring them, whether they come from one or from a recording: at their own pace, a
// recording over and over again. A recording that fits in memory is decoded once. One that stands still gives its frame
// again and again, as a still camera before a still room would, so that what viewers change is drawn.
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture/recorded/seekable_reader.h"
#include "capture/source.h"
#include "server/pipeline/playback.h"

namespace lumigraft::server {

struct PlayedFrame {
  std::shared_ptr<const capture::FrameSet> frame;
  std::chrono::steady_clock::time_point captured;  ///< when it was there, or due
  std::uint64_t round = 0;                         ///< how often time went back or jumped
};

class FramePlayer {
 public:
  static constexpr std::size_t kMemory_bytes = std::size_t{512} << 20;

  explicit FramePlayer(std::unique_ptr<capture::FrameReader> reader, std::size_t memory_bytes = kMemory_bytes);

  /// Waits until the next frame is due. Empty: stopped, or nothing came for a while and the caller asks again.
  /// What is ordered concerns recordings alone.
  std::optional<PlayedFrame> next(const std::stop_token& stop, const Playback::Orders& orders = {});

  /// Of the newest frame of a recording, seconds from its first.
  double at_s() const { return 1e-9 * static_cast<double>(last_time_ns_ - first_time_ns_); }
  /// Of its last frame; as far as it was played where the recording does not say.
  double length_s() const { return 1e-9 * static_cast<double>(length_ns_); }
  bool live() const { return reader_->live(); }

  /// A recording gave no frame in a whole round.
  bool gone() const { return gone_; }
  /// What keeps live cameras from giving pictures: FrameReader::troubles.
  std::vector<std::string> troubles() const { return reader_->troubles(); }

 private:
  std::shared_ptr<const capture::FrameSet> read();
  void seek(std::int64_t from_ns);
  bool begin_again();
  std::optional<PlayedFrame> stand_still(const std::stop_token& stop);
  bool wait_until_due(const std::stop_token& stop) const;
  void set_due(const capture::FrameSet& frame);

  using Clock = std::chrono::steady_clock;
  std::unique_ptr<capture::FrameReader> reader_;
  capture::SeekableReader* seekable_;  ///< the reader, where it is one
  std::size_t memory_bytes_;
  std::size_t kept_bytes_ = 0;
  std::vector<std::shared_ptr<const capture::FrameSet>> kept_;
  bool too_large_ = false;  ///< for memory
  bool all_kept_ = true;    ///< what was read in this round is in memory, from its beginning on
  bool from_memory_ = false;
  std::size_t position_ = 0;  ///< frames given in this round, or the place in memory
  bool jumped_ = false;       ///< to another moment, of which no frame was given yet
  std::uint64_t round_ = 0;
  std::shared_ptr<const capture::FrameSet> newest_;
  std::int64_t stood_still_ns_ = 0;  ///< on the newest frame
  std::int64_t first_time_ns_ = 0;   ///< of the recording
  std::int64_t length_ns_ = 0;
  bool gone_ = false;
  std::int64_t last_time_ns_ = 0;  ///< recorded time of the frame before
  Clock::time_point due_{};        ///< when that one was due
  Clock::duration usual_gap_ = std::chrono::milliseconds(33);
};

}  // namespace lumigraft::server
