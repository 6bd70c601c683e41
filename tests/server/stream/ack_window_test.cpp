#include "server/stream/ack_window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

namespace lumigraft::server {
namespace {

using std::chrono::milliseconds;

/// A picture each 66 ms for 10 s. Half of the round trips take 250 ms more: packets were lost, nothing waits.
std::size_t pictures_after_losses(milliseconds network_trip) {
  AckWindow window;
  window.network_trip(network_trip);
  struct Acknowledgement {
    AckWindow::Clock::time_point when;
    std::uint32_t sequence;
  };
  std::deque<Acknowledgement> coming;
  for (std::uint32_t i = 0; i < 150; ++i) {
    const AckWindow::Clock::time_point now{milliseconds(1000 + 66 * i)};
    for (; !coming.empty() && coming.front().when <= now; coming.pop_front())
      window.acknowledged(coming.front().sequence, coming.front().when);
    window.made(i, now);
    if (window.full(now)) continue;
    window.sent(i, now);
    coming.push_back({now + milliseconds(i / 20 % 2 == 0 ? 210 : 460), i});
    if (coming.size() > 1) coming.back().when = std::max(coming.back().when, coming[coming.size() - 2].when);
  }
  return window.pictures();
}

TEST(AckWindow, IsNotSmallerThanTheNetworksRoundTrip) {
  EXPECT_LE(pictures_after_losses(milliseconds(0)), 3U) << "where nothing is known of the network";
  EXPECT_GE(pictures_after_losses(milliseconds(200)), 4U);
}

TEST(AckWindow, PicturesThatWereNotOfferedCountAsMade) {
  AckWindow every, every_third;
  for (AckWindow* window : {&every, &every_third}) window->network_trip(milliseconds(200));
  for (std::uint32_t i = 0; i < 30; ++i) {
    const AckWindow::Clock::time_point now{milliseconds(1000 + 50 * i)};
    every.made(i, now);
    if (i % 3 == 0) every_third.made(i, now);
  }
  EXPECT_EQ(every.pictures(), 5U);
  EXPECT_EQ(every_third.pictures(), every.pictures());
}

}  // namespace
}  // namespace lumigraft::server
