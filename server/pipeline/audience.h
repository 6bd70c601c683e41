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
    return now - time(last_) < kPipeline.audience_lingers;
  }
  /// Somebody asked for a single picture, or is about to watch.
  void seen(Clock::time_point now) {
    if (now - Clock::time_point(last_.exchange(now.time_since_epoch())) >= kPipeline.audience_lingers)
      came_ = now.time_since_epoch();
  }
  /// A picture was made of a frame whose pose was begun then.
  void picture_made(Clock::time_point begun) { picture_ = begun.time_since_epoch(); }
  /// Whether somebody came after a time without audience, and has not seen a new picture yet: it comes first.
  bool waits_for_picture(Clock::time_point now) const {
    return time(picture_) < time(came_) && now - time(came_) < kPipeline.first_picture_patience;
  }
  /// Whether stages may rest: nobody watches, and the room is known, or was not found out in the time for that.
  bool stages_may_rest(bool learning, Clock::time_point now) {
    return !watches(now) && (!learning || now - time(last_) > kPipeline.learns_unwatched);
  }
  /// The same of stages that no picture waits for.
  bool background_may_rest(bool learning, Clock::time_point now) {
    return stages_may_rest(learning, now) || waits_for_picture(now);
  }

 private:
  static Clock::time_point time(const std::atomic<Clock::duration>& of) { return Clock::time_point(of.load()); }

  const EncoderDemand& demand_;
  std::atomic<Clock::duration> last_;  ///< when somebody watched
  std::atomic<Clock::duration> came_{Clock::duration::zero()}, picture_{Clock::duration::zero()};
};

}  // namespace lumigraft::server
