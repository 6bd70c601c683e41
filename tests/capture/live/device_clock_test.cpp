#include "capture/live/device_clock.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

namespace lumigraft::capture {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(DeviceClock, WithoutJitterOnlyTheOffsetChanges) {
  DeviceClock clock;
  for (std::int64_t i = 0; i < 1000; ++i) {
    EXPECT_EQ(clock.to_host(5 + i * 33 * kMs, 7'000 * kMs + i * 33 * kMs), 7'000 * kMs + i * 33 * kMs);
  }
}

// Two synchronous cameras whose clocks differ by hours and drift by 200 ppm against each other; frames have up to 20 ms
// of latency, and one in a hundred is lost. All frames paired within half a period must belong together.
TEST(DeviceClock, CamerasWithJitterAndDriftArePairedCorrectly) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(0.0, 20e6);
  std::uniform_real_distribution<double> loss(0.0, 1.0);
  DeviceClock one, other;
  const std::int64_t start = 900'000 * kMs;
  std::int64_t worst = 0;
  for (std::int64_t i = 0; i < 20'000; ++i) {
    const std::int64_t truth = start + i * 33 * kMs;
    const auto arrival = [&] { return truth + 3 * kMs + static_cast<std::int64_t>(jitter(random)); };
    const auto elapsed = static_cast<double>(i * 33 * kMs);
    const bool one_lost = loss(random) < 0.01;
    const bool other_lost = loss(random) < 0.01;
    const std::int64_t a = one.to_host(i * 33 * kMs, arrival());
    const std::int64_t b = other.to_host(77'000'000 * kMs + static_cast<std::int64_t>(elapsed * 1.0002), arrival());
    if (!one_lost && !other_lost && i > 60) {
      worst = std::max(worst, std::abs(a - b));
    }
  }
  EXPECT_LT(worst, 5 * kMs) << "a third of the error that would cause a wrong pair";
}

// Each device time is converted twice, some milliseconds apart; windows also begin between the two calls.
TEST(DeviceClock, TheSameDeviceTimeAgainGivesTheSameResult) {
  std::mt19937 random(2);
  std::uniform_int_distribution<std::int64_t> jitter(0, 3 * kMs);
  DeviceClock clock;
  for (std::int64_t i = 0; i < 1000; ++i) {
    const std::int64_t arrival = 7'000 * kMs + i * 33 * kMs + jitter(random);
    const std::int64_t first = clock.to_host(i * 33 * kMs, arrival);
    EXPECT_EQ(clock.to_host(i * 33 * kMs, arrival + 15 * kMs), first) << i;
  }
}

TEST(DeviceClock, IsNeverAfterTheArrivalAndFollowsAJump) {
  DeviceClock clock;
  std::mt19937 random(2);
  std::uniform_int_distribution<std::int64_t> late(0, 10 * kMs);
  for (std::int64_t i = 0; i < 300; ++i) {
    const std::int64_t device = (i < 150 ? 0 : -3'600'000 * kMs) + i * 33 * kMs;
    const std::int64_t arrival = 1'000 * kMs + i * 33 * kMs + late(random);
    const std::int64_t host = clock.to_host(device, arrival);
    EXPECT_LE(host, arrival);
    EXPECT_GE(host, arrival - 11 * kMs);
  }
  EXPECT_EQ(clock.to_host(std::numeric_limits<std::int64_t>::min(), 20'000 * kMs), 20'000 * kMs);
  EXPECT_EQ(clock.to_host(std::numeric_limits<std::int64_t>::max() / 2, 20'033 * kMs), 20'033 * kMs);
}

}  // namespace
}  // namespace lumigraft::capture
