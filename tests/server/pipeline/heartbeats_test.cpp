#include "server/pipeline/heartbeats.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

TEST(Heartbeats, NameTheThreadThatStoodStillLongest) {
  using std::chrono::seconds;
  const auto begin = Heartbeats::Clock::now();
  Heartbeats hearts;
  EXPECT_FALSE(hearts.hung(seconds(10), begin)) << "nothing has begun";
  hearts.beat("capture", begin);
  hearts.beat("relight", begin + seconds(2));
  hearts.beat("encode", begin + seconds(11));
  EXPECT_FALSE(hearts.hung(seconds(10), begin + seconds(9)));
  EXPECT_EQ(hearts.hung(seconds(10), begin + seconds(10)), "capture");
  EXPECT_EQ(hearts.hung(seconds(10), begin + seconds(15)), "capture") << "not relight, which hangs since later";
  hearts.beat("capture", begin + seconds(15));
  EXPECT_EQ(hearts.hung(seconds(10), begin + seconds(15)), "relight");
  hearts.forget("relight");
  EXPECT_FALSE(hearts.hung(seconds(10), begin + seconds(15)));
}

}  // namespace
}  // namespace lumigraft::server
