#pragma once
// How many pictures may be under way to a viewer that acknowledges what it has shown. As many as its network and its
// decoder need to be busy, and no more: what is beyond that waits in buffers and is shown later.
//
// By Little's law as many are under way as are made during a round trip (Little 1961, "A Proof for the Queuing Formula
// L = λW", equation 1). Round trips contain waiting, except that of a picture that is sent while no other is under way.
// While they stay within half a period of pictures of that, one more picture is permitted where pictures were held
// back, up to the number of Little's law. Where two rounds in a row took longer, as many are permitted as the round
// trip without waiting needs, and for some seconds fewer than before. One long round is a stall of the network, not a
// queue. (The idea of comparing with a round trip without queue is that of TCP Vegas: Brakmo, Peterson 1995, "TCP
// Vegas: End to End Congestion Avoidance on a Global Internet", section 3.2.)
//
// No clock: times are given. One thread.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "server/metrics/usual_duration.h"

namespace lumigraft::server {

class AckWindow {
 public:
  using Clock = std::chrono::steady_clock;

  AckWindow();

  /// A picture was made, whether or not it is sent. A gap of numbers is pictures of which nothing was said here.
  void made(std::uint32_t sequence, Clock::time_point now);
  /// The network alone takes so long for a round trip: at least as many pictures are permitted as are made meanwhile.
  /// Where it loses packets round trips vary by more than a period, which is no queue.
  void network_trip(Clock::duration trip) { network_trip_ = trip; }
  void sent(std::uint32_t sequence, Clock::time_point now);
  /// False where this picture was not sent, or was acknowledged before.
  bool acknowledged(std::uint32_t sequence, Clock::time_point now);
  /// Whether the next picture has to wait. Never for a viewer that has not acknowledged yet.
  bool full(Clock::time_point now);

  std::size_t pictures() const;

 private:
  struct Sent {
    std::uint32_t sequence;
    Clock::time_point when;
    bool alone;  ///< none was under way
  };

  void adapt(Clock::duration trip, Clock::time_point now);

  std::deque<Sent> under_way_;  ///< sent and not acknowledged; bounded, the oldest are dropped
  bool acknowledges_ = false;
  bool held_back_ = false;    ///< since the last round
  std::size_t pictures_ = 1;  ///< that may be under way
  std::size_t ceiling_;       ///< beyond it there was a queue
  Clock::time_point ceiling_ends_{};
  int long_rounds_ = 0;           ///< in a row
  Clock::time_point round_{};     ///< the current round ends with a picture that was sent after this
  UsualDuration alone_, period_;  ///< round trip without waiting; time between pictures
  Clock::time_point last_made_{};
  std::uint32_t last_sequence_ = 0;
  Clock::duration network_trip_{};
  Clock::duration patience_;  ///< without an acknowledgement, after which pictures under way count as lost
};

}  // namespace lumigraft::server
