#pragma once
// The rate that a viewer's network carries, and the bound for its stream that follows.
//
// What was sent is confirmed by the network, not by the viewer's decoder (websocket pings). A sample of the rate is
// what was confirmed while a picture was under way, over the longer of the times in which that was sent and confirmed
// (Cardwell et al. 2016, "BBR: Congestion-Based Congestion Control", ACM Queue 14(5); Cheng, Cardwell, Yeganeh,
// Jacobson, "Delivery Rate Estimation", draft-cheng-iccrg-delivery-rate-estimation). A picture that was alone says how
// fast its bytes followed each other. Before anything has waited there is no bound. Where pictures wait in the network
// two round trips in a row, or one long, the bound is at most a fraction of what the network carries; one round trip
// that is a little long is a stall. The network also carries less than the lower limit where it is busy all the time
// with less: the viewer's window may let no picture wait then. Where none wait the bound follows what the network
// carries, and grows by a twentieth a second while the stream makes use of it.
//
// No clock: times are given. One thread.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace lumigraft::server {

struct RateLimits {
  int min_kbit_s = 1000;    ///< whose network carries less gets the smaller stream
  int max_kbit_s = 20'000;  ///< beyond it there is no bound
};

class NetworkRate {
 public:
  using Clock = std::chrono::steady_clock;

  explicit NetworkRate(const RateLimits& limits) : limits_(limits) {}

  /// `id` increases.
  void sent(std::uint32_t id, std::size_t bytes, Clock::time_point now);
  /// And all before it.
  void confirmed(std::uint32_t id, Clock::time_point now);

  /// 0: none.
  int bound_kbit_s() const { return static_cast<int>(bound_kbit_s_); }
  /// The network has not carried the lower limit for a while.
  bool below_limits() const { return rounds_below_ >= 2; }
  /// Of recent round trips; zero while none is known.
  Clock::duration shortest_trip() const;

  /// Begins again with another stream on this network, without bound. Round trips of what is under way still count as
  /// measurements of the network.
  void restart(const RateLimits& limits);

 private:
  struct Sent {
    std::uint32_t id;
    std::size_t bytes;
    Clock::time_point when;
    bool alone;                        ///< nothing was under way
    int stream;                        ///< restart() was called so often before
    std::size_t confirmed_before;      ///< bytes, when it was sent
    Clock::time_point last_confirmed;  ///< as of then: when the newest that was confirmed was, and when that was sent
    Clock::time_point last_confirmed_sent;
  };
  struct Sample {
    Clock::time_point when;
    double kbit_s;
  };
  struct Received {
    Clock::time_point when;
    std::size_t bytes;  ///< in total
  };

  void keep_shortest(Clock::duration trip, Clock::time_point now);
  double sample_kbit_s(const Sent& one, Clock::time_point now) const;
  double carried_kbit_s() const;
  double used_kbit_s(Clock::time_point now) const;
  void adapt(const Sent& one, Clock::time_point now);
  void raise(double fitting_kbit_s, double round_s, Clock::time_point now);
  void lower(double fitting_kbit_s);
  bool busy_below_limit(Clock::time_point now) const;

  RateLimits limits_;
  int stream_ = 0;
  std::deque<Sent> under_way_;
  std::deque<Sample> samples_;     ///< of the last seconds
  std::deque<Received> received_;  ///< in the last second
  std::size_t confirmed_bytes_ = 0;
  Clock::time_point last_confirmed_{}, last_confirmed_sent_{};
  Clock::duration shortest_[2]{};  ///< of this and of the period before; zero: none
  Clock::time_point shortest_since_{};
  Clock::time_point round_{};  ///< the current round ends with a picture that was sent after this
  int long_rounds_ = 0;        ///< in a row
  int rounds_below_ = 0;       ///< decisions in a row for less than the lower limit
  double bound_kbit_s_ = 0;
};

}  // namespace lumigraft::server
