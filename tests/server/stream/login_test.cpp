#include "server/stream/login.h"

#include <gtest/gtest.h>

#include "server/stream/parameters.h"
#include "server/stream/token_bucket.h"

namespace lumigraft::server {
namespace {

constexpr const char* kPhrase = "correct horse+battery";

TEST(Login, WithoutATokenEverybodyIsIn) {
  Login open("");
  EXPECT_FALSE(open.required());
  EXPECT_TRUE(open.authorized("", "", "10.0.0.1", 0));
}

TEST(Login, ProgramsSendTheToken) {
  Login login(kPhrase);
  EXPECT_TRUE(login.authorized(std::string("Bearer ") + kPhrase, "", "a", 0));
  for (const char* wrong :
       {"", "Bearer ", "Bearer correct horse", "correct horse+battery", "Basic correct horse+battery"})
    EXPECT_FALSE(login.authorized(wrong, "", "a", 0)) << wrong;
}

TEST(Login, PersonsGetACookieForADay) {
  Login login(kPhrase);
  std::string cookie;
  EXPECT_EQ(login.log_in("token=correct+horse", "a", 0, cookie), Login::Answer::wrong);
  ASSERT_EQ(login.log_in("x=1&token=correct+horse%2Bbattery", "a", 0, cookie), Login::Answer::accepted);
  const std::string sent = "other=1; " + std::string(Login::kCookie) + "=" + cookie;
  EXPECT_EQ(cookie.size(), 64u);
  EXPECT_TRUE(login.authorized("", sent, "b", 1)) << "from whatever address";
  EXPECT_FALSE(login.authorized("", sent + "0", "b", 1));
  EXPECT_FALSE(login.authorized("", std::string(Login::kCookie) + "=", "b", 1));
  EXPECT_FALSE(login.authorized("", "x" + sent.substr(9), "b", 1));
  EXPECT_FALSE(login.authorized("", sent, "b", kStream.login_lasts_s + 1));
  std::string other;
  login.log_in("token=correct+horse%2Bbattery", "a", 0, other);
  EXPECT_NE(other, cookie);
}

TEST(Login, AttemptsAreLimitedForEachAddress) {
  Login login(kPhrase);
  std::string cookie;
  for (int i = 0; i < kStream.max_attempts; ++i)
    EXPECT_EQ(login.log_in("token=guess", "a", i, cookie), Login::Answer::wrong);
  EXPECT_EQ(login.log_in("token=correct+horse%2Bbattery", "a", 11, cookie), Login::Answer::too_many_attempts);
  EXPECT_FALSE(login.authorized(std::string("Bearer ") + kPhrase, "", "a", 11));
  EXPECT_EQ(login.log_in("token=correct+horse%2Bbattery", "b", 11, cookie), Login::Answer::accepted);
  EXPECT_EQ(login.log_in("token=correct+horse%2Bbattery", "a", kStream.attempts_within_s + 11, cookie),
            Login::Answer::accepted);
}

TEST(TokenBucket, LetsBurstsThroughAndKeepsTheRate) {
  TokenBucket bucket(30, 60);
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += bucket.take(100) ? 1 : 0;
  EXPECT_EQ(taken, 60);
  taken = 0;
  for (int i = 0; i < 1000; ++i) taken += bucket.take(100 + 0.01 * i) ? 1 : 0;
  EXPECT_NEAR(taken, 300, 1);
  EXPECT_FALSE(bucket.take(0)) << "a clock that goes back";
}

}  // namespace
}  // namespace lumigraft::server
