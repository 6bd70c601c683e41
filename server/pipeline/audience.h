#pragma once
// Whether somebody watches. While nobody does, poses are estimated seconds apart, pictures are made half a minute
// apart, and the stages behind them rest longer, so that an exhibition that is closed costs little; the room is learnt
// first, and is kept up to date.
//
// No clock: times are given. Any thread.
#include <atomic>
#include <chrono>

#include "server/pipeline/parameters.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

class Audience {
 public:
  using Clock = std::chrono::steady_clock;

  Audience(const EncoderDemand& demand, Clock::time_point now) : demand_(demand), last_(now.time_since_epoch()) {}

  /// Whether pictures are requested, or were moments ago: who reloads a page is back soon.
  bool watches(Clock::time_point now) {
    if (demand_.any()) seen(now);
    return now - last() < kPipeline.audience_lingers;
  }
  /// Somebody asked for a single picture.
  void seen(Clock::time_point now) { last_ = now.time_since_epoch(); }
  /// Whether stages may rest: nobody watches, and the room is known, or was not found out in the time for that.
  bool stages_may_rest(bool learning, Clock::time_point now) {
    return !watches(now) && (!learning || now - last() > kPipeline.learns_unwatched);
  }

 private:
  Clock::time_point last() const { return Clock::time_point(last_.load()); }

  const EncoderDemand& demand_;
  std::atomic<Clock::duration> last_;  ///< when somebody watched
};

}  // namespace lumigraft::server
