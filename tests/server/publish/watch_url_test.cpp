#include "server/publish/watch_url.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

TEST(WatchUrl, OriginIsWhatThePageMayConnectTo) {
  const auto watch = read_watch_url("https://media.example:8889/kiosk/whep?a=b");
  ASSERT_TRUE(watch);
  EXPECT_EQ(watch->origin, "https://media.example:8889");
  EXPECT_EQ(watch->url, "https://media.example:8889/kiosk/whep?a=b");
  EXPECT_EQ(read_watch_url("http://[::1]/api/webrtc?src=kiosk")->origin, "http://[::1]");
}

/// The origin becomes part of the Content-Security-Policy: what could extend that is no host.
TEST(WatchUrl, RefusesOtherSchemesPasswordsAndPolicies) {
  for (const char* text : {"", "media.example/whep", "rtsp://media.example/kiosk", "https://a:b@media.example/whep",
                           "https://media.example", "https://media.example; script-src */whep",
                           "https://media.example;script-src/whep", "https://*/whep", "https://a,b/whep",
                           "https://media.example:1:2/whep", "https://media.example/wh ep", "javascript://x/y"}) {
    EXPECT_FALSE(read_watch_url(text)) << text;
  }
}

}  // namespace
}  // namespace lumigraft::server
