#include "server/stream/size_choice.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

SizeChoice::Clock::time_point second(int s) { return SizeChoice::Clock::time_point(std::chrono::seconds(1000 + s)); }

TEST(SizeChoice, IsHalfWhereTheNetworkDoesNotCarryMoreAndTriesAgainEverLater) {
  SizeChoice choice;
  EXPECT_EQ(choice.choose(false, second(0)), StreamSize::full);
  int tries = 0;
  for (int s = 1; s < 1000; ++s) {
    const bool before = choice.choose(false, second(s)) == StreamSize::full;
    tries += before ? 1 : 0;
    EXPECT_EQ(choice.choose(before, second(s)), StreamSize::half) << s;
  }
  EXPECT_EQ(tries, 6) << "at first, and after 30, 60, 120, 240 and 480 s";
}

TEST(SizeChoice, GoesBackToFullWhenTheNetworkIsBetter) {
  SizeChoice choice;
  EXPECT_EQ(choice.choose(true, second(0)), StreamSize::half);
  EXPECT_EQ(choice.choose(false, second(29)), StreamSize::half);
  for (int s = 30; s < 600; ++s) EXPECT_EQ(choice.choose(false, second(s)), StreamSize::full);
  EXPECT_EQ(choice.choose(true, second(600)), StreamSize::half);
  EXPECT_EQ(choice.choose(false, second(630)), StreamSize::full) << "what was long ago does not count";
}

TEST(SizeChoice, IsTheOneThatWasAskedFor) {
  SizeChoice choice;
  choice.ask(StreamSize::half);
  EXPECT_EQ(choice.choose(false, second(100)), StreamSize::half);
  choice.ask(StreamSize::full);
  EXPECT_EQ(choice.choose(true, second(200)), StreamSize::full);
  choice.ask(std::nullopt);
  EXPECT_EQ(choice.choose(true, second(300)), StreamSize::half);
}

}  // namespace
}  // namespace lumigraft::server
