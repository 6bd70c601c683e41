#include "server/commands/serve_texts.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

constexpr double kNever = -1;

TEST(Health, APictureOfTheLastSecondsIsHealthy) {
  EXPECT_TRUE(is_healthy(0.1, 0.1, kNever));
  EXPECT_TRUE(is_healthy(4.9, 4.9, kNever));
  EXPECT_FALSE(is_healthy(5.1, 0.1, kNever)) << "rendering hangs, the camera does not";
  EXPECT_FALSE(is_healthy(kNever, kNever, kNever)) << "it has just started";
}

// Nobody watches: a picture every 30 s, a pose every 3 s.
TEST(Health, AServiceThatRestsIsHealthyWhileItFollowsTheCamera) {
  EXPECT_TRUE(is_healthy(30, 3, 0));
  EXPECT_FALSE(is_healthy(30, 8, 0)) << "the camera has gone, or pose hangs";
  EXPECT_FALSE(is_healthy(60, 3, 0)) << "rendering hangs";
  EXPECT_FALSE(is_healthy(kNever, 3, 0));
}

TEST(Health, SomebodyCameAndTheFirstPictureIsInTheMaking) {
  EXPECT_TRUE(is_healthy(30, 0.1, 0.7));
  EXPECT_FALSE(is_healthy(35, 0.1, 5.5)) << "it never came";
}

TEST(Health, TellsThatTheServiceRests) {
  Metrics metrics;
  metrics.frame_posed(false);
  metrics.frame_made();
  EXPECT_LT(metrics.since_rest_s(), 0);
  EXPECT_NE(health(metrics).json.find("\"resting\":false"), std::string::npos);
  metrics.frame_posed(true);
  EXPECT_EQ(metrics.since_rest_s(), 0);
  EXPECT_NE(health(metrics).json.find("\"resting\":true"), std::string::npos);
  EXPECT_NE(metrics.prometheus().find("lumigraft_resting 1\n"), std::string::npos);
  metrics.frame_posed(false);
  EXPECT_FALSE(metrics.rests());
  EXPECT_GE(metrics.since_rest_s(), 0);
}

}  // namespace
}  // namespace lumigraft::server
