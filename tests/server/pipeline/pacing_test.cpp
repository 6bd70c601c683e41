#include "server/pipeline/pacing.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

namespace lumigraft::server {
namespace {

using std::chrono::milliseconds;

void keep_a_core_busy(PaceClock::duration wall) {
  for (const auto end = PaceClock::now() + wall; PaceClock::now() < end;) {
  }
}

TEST(DutyCycle, LastsSomeTimesTheWork) {
  DutyCycle rest(milliseconds(0));
  EXPECT_TRUE(rest.over(2)) << "nothing was done yet";
  {
    const ScopedWork work(rest);
    EXPECT_FALSE(rest.over(0)) << "at work";
    keep_a_core_busy(milliseconds(50));
  }
  EXPECT_TRUE(rest.over(0));
  EXPECT_FALSE(rest.over(1000));
  while (!rest.over(2)) {
    std::this_thread::sleep_for(milliseconds(5));
  }
}

TEST(DutyCycle, KeepsToTheRateOfShortWork) {
  DutyCycle rest(std::chrono::years(50));  // longer than any machine has run
  EXPECT_TRUE(rest.over(0)) << "nothing was done yet";
  try {
    const ScopedWork work(rest);
    throw std::runtime_error("work that fails is work");
  } catch (const std::runtime_error&) {
  }
  EXPECT_FALSE(rest.over(0));
}

TEST(LatencyScheduler, PoseBeginsWhenRelightIsNearlyDone) {
  LatencyScheduler pace;
  for (int i = 0; i < 20; ++i) {
    pace.relight_took(milliseconds(400));
    pace.pose_took(milliseconds(40));
  }
  const auto before = PaceClock::now();
  pace.relight_begins();
  const auto after = PaceClock::now();
  EXPECT_NEAR((pace.pose_begins() - before) / milliseconds(1), 350, 2 + (after - before) / milliseconds(1));
}

}  // namespace
}  // namespace lumigraft::server
