#include "server/stream/ack_window.h"

#include <algorithm>
#include <utility>

#include "server/stream/parameters.h"

namespace lumigraft::server {

AckWindow::AckWindow() : ceiling_(kStream.max_in_flight), patience_(kStream.ack_patience) {}

void AckWindow::made(std::uint32_t sequence, Clock::time_point now) {
  if (last_made_ != Clock::time_point{})
    period_.add((now - last_made_) / std::max<std::int64_t>(std::int64_t{sequence} - last_sequence_, 1));
  last_made_ = now;
  last_sequence_ = sequence;
}

std::size_t AckWindow::pictures() const {
  if (period_.usual() <= Clock::duration::zero()) return pictures_;
  const auto during = static_cast<std::size_t>(network_trip_ / period_.usual()) + 1;
  return std::max(pictures_, std::min(during, kStream.max_in_flight));
}

void AckWindow::sent(std::uint32_t sequence, Clock::time_point now) {
  under_way_.push_back({sequence, now, under_way_.empty()});
  if (under_way_.size() > kStream.max_in_flight) under_way_.pop_front();
}

bool AckWindow::acknowledged(std::uint32_t sequence, Clock::time_point now) {
  acknowledges_ = true;
  const auto known = std::ranges::find(under_way_, sequence, &Sent::sequence);
  if (known == under_way_.end()) return false;
  const Sent shown = *known;
  under_way_.erase(under_way_.begin(), known + 1);  // earlier pictures were skipped by the viewer
  patience_ = kStream.ack_patience;
  if (shown.alone) alone_.add(now - shown.when);
  if (shown.when >= round_) adapt(now - shown.when, now);
  return true;
}

/// Once a round trip: what was sent before the last decision does not show its effect.
void AckWindow::adapt(Clock::duration trip, Clock::time_point now) {
  round_ = now;
  const bool wanted_more = std::exchange(held_back_, false);
  long_rounds_ = trip > alone_.usual() + period_.usual() / 2 ? long_rounds_ + 1 : 0;
  if (now >= ceiling_ends_) ceiling_ = kStream.max_in_flight;
  const auto made_during = [&](Clock::duration time) {
    const Clock::duration period = std::max<Clock::duration>(period_.usual(), std::chrono::milliseconds(1));
    return std::max<std::size_t>(static_cast<std::size_t>((time + period - Clock::duration(1)) / period), 1);
  };
  if (long_rounds_ >= 2 && pictures_ > 1) {
    ceiling_ = pictures_ - 1;
    pictures_ = std::min(made_during(alone_.usual()), ceiling_);
    ceiling_ends_ = now + kStream.window_stays;
    long_rounds_ = 0;
  } else if (long_rounds_ == 0 && wanted_more && pictures_ < std::min(made_during(trip), ceiling_)) {
    ++pictures_;
  }
}

bool AckWindow::full(Clock::time_point now) {
  if (!acknowledges_ || under_way_.size() < pictures()) return false;
  if (now - under_way_.back().when >= patience_) {
    // A viewer that loses pictures on its side never acknowledges them. One that stands still gets ever fewer.
    under_way_.clear();
    patience_ *= 2;
    return false;
  }
  held_back_ = true;
  return true;
}

}  // namespace lumigraft::server
