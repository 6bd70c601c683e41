#include "server/stream/request_guard.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

TEST(RequestGuard, LoopbackAnswersLoopbackNamesAlone) {
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1:8080", "[::1]:8080", "[::1]", "LocalHost:1"}) {
    EXPECT_TRUE(request_allowed(host, "", true)) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example",
                           "[::1", "[::1].evil.example", "10.0.0.1:8080"}) {
    EXPECT_FALSE(request_allowed(host, "", true)) << host;
  }
  EXPECT_TRUE(request_allowed("kiosk.example", "", false));
}

TEST(RequestGuard, OnlyPagesOfThisHostAndPort) {
  EXPECT_TRUE(request_allowed("localhost:8080", "http://localhost:8080", true));
  EXPECT_TRUE(request_allowed("kiosk.example", "https://kiosk.example", false));
  for (const char* origin :
       {"http://evil.example", "http://localhost:9999", "null", "http://localhost:8080.evil.example", "file://"}) {
    EXPECT_FALSE(request_allowed("localhost:8080", origin, true)) << origin;
    EXPECT_FALSE(request_allowed("localhost:8080", origin, false)) << origin;
  }
}

}  // namespace
}  // namespace lumigraft::server
