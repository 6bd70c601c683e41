#include "server/stream/network_rate.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

double seconds(NetworkRate::Clock::duration time) { return std::chrono::duration<double>(time).count(); }

double kbit(std::size_t bytes) { return 8e-3 * static_cast<double>(bytes); }

}  // namespace

void NetworkRate::sent(std::uint32_t id, std::size_t bytes, Clock::time_point now) {
  under_way_.push_back(
      {id, bytes, now, under_way_.empty(), stream_, confirmed_bytes_, last_confirmed_, last_confirmed_sent_});
  if (under_way_.size() > kStream.max_unconfirmed) under_way_.pop_front();  // of a viewer that confirms nothing
}

void NetworkRate::confirmed(std::uint32_t id, Clock::time_point now) {
  const auto known = std::ranges::find(under_way_, id, &Sent::id);
  if (known == under_way_.end()) return;
  const Sent newest = *known;
  for (auto one = under_way_.begin(); one != known + 1; ++one) confirmed_bytes_ += one->bytes;
  under_way_.erase(under_way_.begin(), known + 1);
  keep_shortest(now - newest.when, now);
  const std::size_t meanwhile = confirmed_bytes_ - newest.confirmed_before;
  if (meanwhile >= kStream.telling_bytes) samples_.push_back({now, sample_kbit_s(newest, now)});
  while (!samples_.empty() && now - samples_.front().when > kStream.rate_remembered) samples_.pop_front();
  received_.push_back({now, confirmed_bytes_});
  while (now - received_.front().when > std::chrono::seconds(1)) received_.pop_front();
  last_confirmed_ = now;
  last_confirmed_sent_ = newest.when;
  if (newest.stream == stream_ && newest.when >= round_) adapt(newest, now);
}

void NetworkRate::keep_shortest(Clock::duration trip, Clock::time_point now) {
  if (now - shortest_since_ >= kStream.shortest_trip_remembered) {
    shortest_[1] = std::exchange(shortest_[0], Clock::duration::zero());
    shortest_since_ = now;
  }
  if (shortest_[0] == Clock::duration::zero() || trip < shortest_[0]) shortest_[0] = trip;
}

NetworkRate::Clock::duration NetworkRate::shortest_trip() const {
  if (shortest_[0] == Clock::duration::zero() || shortest_[1] == Clock::duration::zero())
    return std::max(shortest_[0], shortest_[1]);
  return std::min(shortest_[0], shortest_[1]);
}

/// One that was alone took its way and the time in which its bytes followed each other.
double NetworkRate::sample_kbit_s(const Sent& one, Clock::time_point now) const {
  const double elapsed_s =
      one.alone ? seconds(now - one.when - shortest_trip())
                : std::max(seconds(now - one.last_confirmed), seconds(one.when - one.last_confirmed_sent));
  return kbit(confirmed_bytes_ - one.confirmed_before) / std::max(elapsed_s, 1e-3);
}

/// 0 where it is unknown. Most samples are below it: those with a stall, and of pictures that did not fill the network.
double NetworkRate::carried_kbit_s() const {
  if (samples_.empty()) return 0;
  std::vector<double> rates;
  for (const Sample& one : samples_) rates.push_back(one.kbit_s);
  const auto chosen = rates.begin() + static_cast<std::ptrdiff_t>(
                                          std::ceil(kStream.rate_quantile * static_cast<double>(rates.size() - 1)));
  std::ranges::nth_element(rates, chosen);
  return *chosen;
}

/// Of the stream, in about the last second; 0 where too little is known.
double NetworkRate::used_kbit_s(Clock::time_point now) const {
  const Received& first = received_.front();
  return first.when == now ? 0 : kbit(confirmed_bytes_ - first.bytes) / seconds(now - first.when);
}

/// Once a round trip: what was sent before the last decision does not show its effect.
void NetworkRate::adapt(const Sent& one, Clock::time_point now) {
  const double round_s = seconds(now - std::exchange(round_, now));
  double wait_s = seconds(now - one.when - shortest_trip());
  if (bound_kbit_s_ > 0) wait_s -= kbit(one.bytes) / bound_kbit_s_;  // a large picture takes its time
  long_rounds_ = wait_s > kStream.longest_wait_s ? long_rounds_ + 1 : 0;
  const double fitting_kbit_s = kStream.share_of_rate * carried_kbit_s();
  if (long_rounds_ == 0) {
    raise(fitting_kbit_s, round_s, now);
  } else if (long_rounds_ >= 2 || (wait_s > kStream.freezing_wait_s && one.bytes >= kStream.telling_bytes)) {
    long_rounds_ = 0;
    return lower(fitting_kbit_s);
  }
  if (busy_below_limit(now)) ++rounds_below_;
}

/// Whether the stream has the lowest bound, and the network is busy with less than that all the time.
bool NetworkRate::busy_below_limit(Clock::time_point now) const {
  const double carried_kbit_s = this->carried_kbit_s();
  return bound_kbit_s_ > 0 && bound_kbit_s_ <= limits_.min_kbit_s && carried_kbit_s < limits_.min_kbit_s &&
         used_kbit_s(now) > kStream.busy_network * carried_kbit_s;
}

void NetworkRate::raise(double fitting_kbit_s, double round_s, Clock::time_point now) {
  if (bound_kbit_s_ == 0) return;
  if (fitting_kbit_s > 1.2 * bound_kbit_s_) {
    bound_kbit_s_ = std::min(fitting_kbit_s, 1.5 * bound_kbit_s_);
  } else if (used_kbit_s(now) > kStream.bound_in_use * bound_kbit_s_) {
    bound_kbit_s_ *= 1 + kStream.growth_per_s * std::min(round_s, 1.0);
  }
  if (bound_kbit_s_ > limits_.min_kbit_s) rounds_below_ = 0;
  if (bound_kbit_s_ >= limits_.max_kbit_s) bound_kbit_s_ = 0;
}

void NetworkRate::lower(double fitting_kbit_s) {
  if (fitting_kbit_s == 0) return;
  const bool at_limit = bound_kbit_s_ > 0 && bound_kbit_s_ <= limits_.min_kbit_s;
  rounds_below_ = at_limit && fitting_kbit_s < limits_.min_kbit_s ? rounds_below_ + 1 : 0;
  if (fitting_kbit_s < (bound_kbit_s_ > 0 ? bound_kbit_s_ : limits_.max_kbit_s))
    bound_kbit_s_ = std::max<double>(fitting_kbit_s, limits_.min_kbit_s);
}

void NetworkRate::restart(const RateLimits& limits) {
  limits_ = limits;
  ++stream_;
  rounds_below_ = long_rounds_ = 0;
  bound_kbit_s_ = 0;
}

}  // namespace lumigraft::server
