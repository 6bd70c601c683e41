#pragma once
// When frames of a recording are due, and which are skipped because the next one is due already.
//
// A frame that is late by more than a period is skipped where frames are usually read in half a period, so that what
// was lost is caught up within the time that was lost. Where reading takes longer, and after a stall longer than
// too_late, the recording continues where it was. Either way no frame is old when it is shown. No clock: times are
// given. One thread.
#include <algorithm>
#include <chrono>

#include "server/metrics/usual_duration.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

class RecordedPace {
 public:
  using Clock = std::chrono::steady_clock;

  /// The next frame is due now, as the first one or after a jump.
  void begin(Clock::time_point now) { due_ = went_on_ = now; }
  /// A frame was read that follows the last one after `gap`. False: it is to be skipped.
  bool shows(Clock::duration gap, Clock::time_point now) {
    reading_.add(now - went_on_);
    gap_ = std::max<Clock::duration>(gap, std::chrono::milliseconds(1));
    due_ += gap_;
    went_on_ = now;
    const Clock::duration late = now - due_;
    if (late > gap_ && late <= kPipeline.too_late && reading_.usual() <= gap_ / 2) return false;
    if (late > gap_) due_ = now;
    went_on_ = std::max(now, due_);
    return true;
  }
  /// The newest frame is shown again.
  void repeat(Clock::time_point now) { due_ = went_on_ = std::max(due_ + gap_, now); }

  /// Of the newest frame.
  Clock::time_point due() const { return due_; }
  /// The newest time between two frames.
  Clock::duration gap() const { return gap_; }

 private:
  Clock::time_point due_{};
  Clock::duration gap_ = std::chrono::milliseconds(33);
  Clock::time_point went_on_{};  ///< when reading of the next frame could begin
  UsualDuration reading_;
};

}  // namespace lumigraft::server
