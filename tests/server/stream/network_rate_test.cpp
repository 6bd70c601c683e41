// Bound of a stream on simulated networks: a queue in front of a link with rate and delay.
#include "server/stream/network_rate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <vector>

namespace lumigraft::server {
namespace {

constexpr double kPictures_hz = 15, kKeyEvery_s = 2, kBurst_s = 0.25;

struct Network {
  std::function<double(double now_s)> kbit_s = [](double) { return 2000.0; };
  double one_way_s = 0.1;
  std::function<double(double now_s)> stall_s = [](double) { return 0.0; };  ///< added to what arrives now
};

/// A stream that would take `kbit_s`, with key frames of a quarter of a second of it.
struct Encoded {
  double kbit_s = 6000;
};

NetworkRate::Clock::time_point time_at(double s) {
  return NetworkRate::Clock::time_point(std::chrono::nanoseconds(std::llround(1e9 * s)));
}

struct Moment {
  double when_s, bound_kbit_s, age_s;
  bool below;
};

std::vector<Moment> bounds_over(const Network& network, const Encoded& stream, const RateLimits& limits, double end_s) {
  NetworkRate rate(limits);
  std::deque<std::pair<double, std::uint32_t>> arriving;
  std::vector<Moment> moments;
  std::vector<double> sent_s;
  double free_s = 0, last_s = 0;
  const auto confirm = [&](double until_s) {
    while (!arriving.empty() && arriving.front().first + network.one_way_s <= until_s) {
      const auto [when_s, id] = arriving.front();
      arriving.pop_front();
      rate.confirmed(id, time_at(when_s + network.one_way_s));
      moments.push_back({when_s, static_cast<double>(rate.bound_kbit_s()), when_s - sent_s[id], rate.below_limits()});
    }
  };
  rate.sent(0xffffffff, 0, time_at(0.5));  // of the greeting
  rate.confirmed(0xffffffff, time_at(0.5 + 2 * network.one_way_s));
  for (std::uint32_t i = 0; i < end_s * kPictures_hz; ++i) {
    const double now_s = 1 + i / kPictures_hz;
    confirm(now_s);
    sent_s.push_back(now_s);
    if (arriving.size() > 2 * network.one_way_s * kPictures_hz + 2) continue;  // as the window of the viewer
    const double bound = rate.bound_kbit_s() > 0 ? std::min<double>(rate.bound_kbit_s(), stream.kbit_s) : stream.kbit_s;
    const bool key = i % static_cast<std::uint32_t>(kKeyEvery_s * kPictures_hz) == 0;
    const double kbit = bound * (key ? kBurst_s : 1 / kPictures_hz);
    free_s = std::max(now_s, free_s) + kbit / network.kbit_s(now_s);
    last_s = std::max(last_s, free_s + network.one_way_s + network.stall_s(now_s));
    rate.sent(i, static_cast<std::size_t>(125 * kbit), time_at(now_s));
    arriving.emplace_back(last_s, i);
  }
  return moments;
}

double mean_bound(const std::vector<Moment>& moments, double from_s, double to_s) {
  double sum = 0, count = 0;
  for (const Moment& one : moments)
    if (one.when_s >= from_s && one.when_s < to_s) sum += one.bound_kbit_s, ++count;
  return sum / count;
}

double oldest_s(const std::vector<Moment>& moments, double from_s, double to_s) {
  double oldest = 0;
  for (const Moment& one : moments)
    if (one.when_s >= from_s && one.when_s < to_s) oldest = std::max(oldest, one.age_s);
  return oldest;
}

TEST(NetworkRate, ASlowNetworkBoundsTheStreamAndPicturesStayNew) {
  for (const double kbit_s : {1500.0, 2000.0, 4000.0}) {
    for (const double one_way_s : {0.01, 0.1}) {
      SCOPED_TRACE(testing::Message() << kbit_s << " kbit/s, " << one_way_s << " s away");
      const auto moments = bounds_over({.kbit_s = [&](double) { return kbit_s; }, .one_way_s = one_way_s}, {}, {}, 60);
      EXPECT_GT(mean_bound(moments, 6, 60), 0.7 * kbit_s);
      EXPECT_LT(mean_bound(moments, 6, 60), 1.05 * kbit_s);
      EXPECT_LT(oldest_s(moments, 6, 60), one_way_s + kBurst_s + 0.3)
          << "key frame, and what waits before it is noticed";
      EXPECT_FALSE(moments.back().below);
    }
  }
}

TEST(NetworkRate, AFastNetworkBoundsNothing) {
  for (const double one_way_s : {0.0001, 0.05}) {
    const auto moments = bounds_over({.kbit_s = [](double) { return 200'000.0; }, .one_way_s = one_way_s}, {}, {}, 30);
    for (const Moment& one : moments) EXPECT_EQ(one.bound_kbit_s, 0) << one.when_s;
  }
}

/// As of a machine with little time for its browser.
TEST(NetworkRate, StallsOfANearViewerBoundNothing) {
  const auto stalls = [](double now_s) { return std::fmod(now_s, 3) < 0.1 ? 0.5 : 0.0; };
  for (const double kbit_s : {200.0, 6000.0}) {
    const auto moments =
        bounds_over({.kbit_s = [](double) { return 200'000.0; }, .one_way_s = 0.0005, .stall_s = stalls},
                    {.kbit_s = kbit_s}, {}, 30);
    for (const Moment& one : moments) EXPECT_EQ(one.bound_kbit_s, 0) << one.when_s << " s, " << kbit_s << " kbit/s";
  }
}

TEST(NetworkRate, TheBoundFollowsANetworkThatChanges) {
  const auto moments =
      bounds_over({.kbit_s = [](double now_s) { return now_s < 20 || now_s > 40 ? 5000.0 : 1500.0; }}, {}, {}, 80);
  EXPECT_LT(mean_bound(moments, 23, 40), 1.1 * 1500);
  EXPECT_GT(mean_bound(moments, 65, 80), 0.7 * 5000);
}

TEST(NetworkRate, LessThanTheLowerLimitIsSaidAndNoBound) {
  const auto moments = bounds_over({.kbit_s = [](double) { return 400.0; }}, {.kbit_s = 2000}, {}, 20);
  const auto said = std::ranges::find(moments, true, &Moment::below);
  ASSERT_NE(said, moments.end());
  EXPECT_LT(said->when_s, 10);
  for (const Moment& one : moments) EXPECT_TRUE(one.bound_kbit_s == 0 || one.bound_kbit_s >= RateLimits{}.min_kbit_s);
}

/// A viewer asks for a stream before its network has answered the greeting.
TEST(NetworkRate, TheGreetingTellsOfTheNetworkAlsoOnceAStreamHasBegun) {
  const RateLimits limits;
  NetworkRate rate(limits);
  rate.sent(0xffffffff, 0, time_at(1));
  rate.restart(limits);
  rate.sent(0, 90'000, time_at(1.01));
  rate.confirmed(0xffffffff, time_at(1.2));
  EXPECT_EQ(rate.bound_kbit_s(), 0);
  rate.confirmed(0, time_at(2.5));
  EXPECT_EQ(rate.bound_kbit_s(), limits.min_kbit_s) << "720 kbit took 1.3 s more than the greeting";
}

/// As beside a near viewer: what the window of the far one does not let through is missed and does not wait.
TEST(NetworkRate, ANetworkThatIsBusyWithLessThanTheLowerLimitIsSaidThoughNoPictureWaits) {
  constexpr double kCarried_kbit_s = 600, kRoundTrip_s = 0.2;
  const auto below_with = [](std::size_t in_flight) {
    NetworkRate rate(RateLimits{});
    rate.sent(0, 0, time_at(0.5));
    rate.confirmed(0, time_at(0.5 + kRoundTrip_s));
    rate.sent(1, 90'000, time_at(1));
    rate.confirmed(1, time_at(1 + kRoundTrip_s + 720 / kCarried_kbit_s));
    std::deque<std::pair<double, std::uint32_t>> arriving;
    double now_s = 3, free_s = 0;
    for (std::uint32_t id = 2; now_s < 8 && !rate.below_limits(); ++id) {
      while (arriving.size() >= in_flight) {
        now_s = arriving.front().first;
        rate.confirmed(arriving.front().second, time_at(now_s));
        arriving.pop_front();
      }
      free_s = std::max(now_s, free_s) + 80 / kCarried_kbit_s;
      rate.sent(id, 10'000, time_at(now_s));
      arriving.emplace_back(free_s + kRoundTrip_s, id);
    }
    return rate.below_limits();
  };
  EXPECT_TRUE(below_with(3)) << "they fill the network";
  EXPECT_FALSE(below_with(1)) << "the network may carry more";
}

}  // namespace
}  // namespace lumigraft::server
