#pragma once
// Frames of a live camera, or of a recording at its recorded rate, in a loop. A recording that fits in memory is
// decoded once. Frames that are late are skipped (recorded_pace.h). While it is paused its current frame is repeated,
// as from a camera that does not move, so that changes by viewers are rendered.
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture/recorded/seekable_reader.h"
#include "capture/source.h"
#include "server/pipeline/pacing.h"
#include "server/pipeline/parameters.h"
#include "server/pipeline/playback.h"
#include "server/pipeline/recorded_pace.h"

namespace lumigraft::server {

struct PlayedFrame {
  std::shared_ptr<const capture::FrameSet> frame;
  std::chrono::steady_clock::time_point captured;  ///< time of arrival; of a recording, when it was due
  std::uint64_t round = 0;                         ///< number of times that frame time went back or jumped
};

class FramePlayer {
 public:
  explicit FramePlayer(std::unique_ptr<capture::FrameReader> reader, std::size_t memory_bytes = kPipeline.memory_bytes,
                       PlayClock clock = {});

  /// Waits until the next frame is due. Empty: stopped, or no frame arrived within `patience` and the caller retries.
  /// `orders` apply to recordings only.
  std::optional<PlayedFrame> next(const std::stop_token& stop, const Playback::Orders& orders = {});

  /// Time of the newest frame of a recording, in seconds after its first.
  double at_s() const { return 1e-9 * static_cast<double>(last_time_ns_ - first_time_ns_); }
  /// Time of its last frame; of the last one played where the recording does not state its length.
  double length_s() const { return 1e-9 * static_cast<double>(length_ns_); }
  bool live() const { return reader_->live(); }

  /// A recording gave no frame from its beginning to its end.
  bool gone() const { return gone_; }
  /// See FrameReader::faults.
  std::vector<std::string> faults() const { return reader_->faults(); }

 private:
  std::shared_ptr<const capture::FrameSet> read();
  void seek(std::int64_t from_ns);
  bool begin_again();
  std::optional<PlayedFrame> repeat_newest(const std::stop_token& stop);
  std::shared_ptr<const capture::FrameSet> read_round();
  bool due(const capture::FrameSet& frame);

  using Clock = std::chrono::steady_clock;
  std::unique_ptr<capture::FrameReader> reader_;
  capture::SeekableReader* seekable_;  ///< the reader, if it can seek
  std::size_t memory_bytes_;
  PlayClock clock_;
  std::size_t kept_bytes_ = 0;
  std::vector<std::shared_ptr<const capture::FrameSet>> kept_;
  bool too_large_ = false;  ///< to be held in memory
  bool all_kept_ = true;    ///< all frames read in this round are in memory, from the first one on
  bool from_memory_ = false;
  std::size_t position_ = 0;  ///< number of frames given in this round, or index in memory
  bool jumped_ = false;       ///< seeked, and no frame was given since
  std::uint64_t round_ = 0;
  std::shared_ptr<const capture::FrameSet> newest_;
  std::int64_t repeated_ns_ = 0;    ///< for which the newest frame was repeated
  std::int64_t first_time_ns_ = 0;  ///< of the recording's first frame
  std::int64_t length_ns_ = 0;
  bool gone_ = false;
  std::int64_t last_time_ns_ = 0;  ///< recorded time of the previous frame
  RecordedPace pace_;
};

}  // namespace lumigraft::server
