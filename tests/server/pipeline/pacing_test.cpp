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
  const PaceClock::time_point begin{};
  for (int i = 0; i < 3; ++i) {
    pace.relight_begins(begin);
    pace.relight_ends(begin + milliseconds(400));
    pace.pose_took(milliseconds(40));
  }
  EXPECT_LE(pace.pose_begins(), begin) << "relight is free";
  pace.relight_begins(begin);
  EXPECT_EQ(pace.pose_begins() - begin, milliseconds(350));
}

TEST(LatencyScheduler, OneStallChangesNothing) {
  LatencyScheduler pace;
  PaceClock::time_point now{};
  for (const int took_ms : {50, 50, 50, 2000}) {
    pace.relight_begins(now);
    now += milliseconds(took_ms);
    pace.relight_ends(now);
  }
  pace.relight_begins(now);
  EXPECT_EQ(pace.pose_begins() - now, milliseconds(50));
}

TEST(LatencyScheduler, TheWaitEndsWithRelight) {
  LatencyScheduler pace;
  pace.relight_begins(PaceClock::now());
  pace.relight_ends(PaceClock::now() + std::chrono::hours(1));
  pace.relight_begins();
  const std::stop_source stop;
  const std::jthread relight([&] { pace.relight_ends(); });
  EXPECT_TRUE(pace.wait_for_pose(stop.get_token())) << "the usual end is an hour away";
}

TEST(LatencyScheduler, WaitsForRelightWhereThatIsWanted) {
  LatencyScheduler pace;
  pace.relight_begins();
  const std::stop_source stop;
  bool ended = false;
  const std::jthread relight([&] {
    ended = true;
    pace.relight_ends();
  });
  EXPECT_TRUE(pace.wait_for_relight(std::chrono::hours(1), stop.get_token()));
  EXPECT_TRUE(ended) << "though relight was usually done at once";
  pace.relight_begins();
  EXPECT_TRUE(pace.wait_for_relight(PaceClock::duration::zero(), stop.get_token())) << "no longer than asked for";
}

}  // namespace
}  // namespace lumigraft::server
