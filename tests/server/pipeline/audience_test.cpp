#include "server/pipeline/audience.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;

const Audience::Clock::time_point kStart{std::chrono::hours(1)};

TEST(Audience, ViewersWatchAndLinger) {
  EncoderDemand demand;
  Audience audience(demand, kStart);
  EXPECT_TRUE(audience.watches(kStart)) << "who starts a service looks at it";
  EXPECT_FALSE(audience.watches(kStart + kPipeline.audience_lingers));
  demand.h264 = 1;
  const auto later = kStart + 100s;
  EXPECT_TRUE(audience.watches(later));
  EXPECT_FALSE(audience.stages_may_rest(false, later));
  demand.h264 = 0;
  EXPECT_TRUE(audience.watches(later + kPipeline.audience_lingers - 1ms)) << "a page that is loaded again";
  EXPECT_FALSE(audience.watches(later + kPipeline.audience_lingers));
  EXPECT_TRUE(audience.stages_may_rest(false, later + kPipeline.audience_lingers));
  demand.jpeg = 1;
  EXPECT_FALSE(audience.stages_may_rest(false, later + kPipeline.audience_lingers)) << "at once";
}

TEST(Audience, ASinglePictureIsWatchedToo) {
  const EncoderDemand demand;
  Audience audience(demand, kStart);
  const auto later = kStart + 100s;
  EXPECT_FALSE(audience.watches(later));
  audience.seen(later);
  EXPECT_TRUE(audience.watches(later + 1s));
}

TEST(Audience, TheFirstPictureComesBeforeTheBackground) {
  EncoderDemand demand;
  Audience audience(demand, kStart);
  EXPECT_FALSE(audience.waits_for_picture(kStart)) << "the room is learnt first at the start";
  const auto came = kStart + 100s;
  audience.picture_made(came - 30s);
  EXPECT_TRUE(audience.background_may_rest(false, came));
  demand.h264 = 1;
  EXPECT_FALSE(audience.stages_may_rest(false, came));
  EXPECT_TRUE(audience.background_may_rest(false, came));
  audience.picture_made(came - 1ms);
  EXPECT_TRUE(audience.background_may_rest(false, came + 1ms)) << "that one was begun before";
  audience.picture_made(came + 1ms);
  EXPECT_FALSE(audience.background_may_rest(false, came + 2ms));
  EXPECT_FALSE(audience.waits_for_picture(came + 3s)) << "who goes on watching waits for nothing";
}

TEST(Audience, WithoutPicturesTheBackgroundRestsNoLonger) {
  EncoderDemand demand;
  Audience audience(demand, kStart);
  const auto came = kStart + 100s;
  audience.seen(came);
  EXPECT_TRUE(audience.background_may_rest(false, came));
  EXPECT_FALSE(audience.background_may_rest(false, came + kPipeline.first_picture_patience));
}

TEST(Audience, TheRoomIsLearntFirstButNotForever) {
  const EncoderDemand demand;
  Audience audience(demand, kStart);
  const auto soon = kStart + kPipeline.learns_unwatched, late = soon + 1ms;
  EXPECT_FALSE(audience.stages_may_rest(true, soon));
  EXPECT_TRUE(audience.stages_may_rest(false, soon));
  EXPECT_TRUE(audience.stages_may_rest(true, late)) << "as in a dark room, where no tag is seen";
}

}  // namespace
}  // namespace lumigraft::server
