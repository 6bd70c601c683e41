#include "server/stream/request_guard.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>

namespace lumigraft::server {
namespace {

ListenerSettings on(const std::string& address) {
  ListenerSettings listener;
  listener.address = address;
  return listener;
}

TEST(RequestGuard, LoopbackAnswersLoopbackNamesAlone) {
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1:8080", "[::1]:8080", "[::1]", "LocalHost:1"}) {
    EXPECT_TRUE(request_allowed(host, "", on("127.0.0.1"))) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example",
                           "[::1", "[::1].evil.example", "10.0.0.1:8080", "localhost:evil.example", "::1"}) {
    EXPECT_FALSE(request_allowed(host, "", on("127.0.0.1"))) << host;
  }
}

// A page of evil.example whose name resolves to this machine sends its own name as Host and Origin.
TEST(RequestGuard, OtherListenersAnswerAddressesAndTheMachinesName) {
  std::array<char, 256> machine{};
  ASSERT_EQ(::gethostname(machine.data(), machine.size() - 1), 0);
  for (const std::string& host : {std::string("10.0.0.1:8080"), std::string("[fe80::1]:8080"), std::string("localhost"),
                                  std::string(machine.data()), std::string(machine.data()) + ".local:8080"}) {
    EXPECT_TRUE(request_allowed(host, "http://" + host, on("0.0.0.0"))) << host;
  }
  for (const char* host : {"evil.example", "evil.example:8080", "10.0.0.1.evil.example", "", "fe80::1"}) {
    EXPECT_FALSE(request_allowed(host, std::string("http://") + host, on("0.0.0.0"))) << host;
  }
}

TEST(RequestGuard, OnlyPagesOfThisHostAndPort) {
  EXPECT_TRUE(request_allowed("localhost:8080", "http://localhost:8080", on("127.0.0.1")));
  EXPECT_TRUE(request_allowed("10.0.0.1", "https://10.0.0.1", on("0.0.0.0")));
  for (const char* origin :
       {"http://evil.example", "http://localhost:9999", "null", "http://localhost:8080.evil.example", "file://"}) {
    EXPECT_FALSE(request_allowed("localhost:8080", origin, on("127.0.0.1"))) << origin;
    EXPECT_FALSE(request_allowed("localhost:8080", origin, on("0.0.0.0"))) << origin;
  }
}

TEST(RequestGuard, ProxiesThatKeepTheHostOrReplaceIt) {
  ListenerSettings kept = on("127.0.0.1"), replaced = on("127.0.0.1"), file;
  kept.allowed_hosts = {"Museum.example"};
  EXPECT_TRUE(request_allowed("museum.example", "https://museum.example", kept));
  EXPECT_TRUE(request_allowed("museum.example:8443", "https://museum.example:8443", kept));
  EXPECT_FALSE(request_allowed("other.example", "https://other.example", kept));
  EXPECT_FALSE(request_allowed("museum.example", "https://other.example", kept));
  replaced.allowed_origins = {"https://museum.example"};
  EXPECT_TRUE(request_allowed("127.0.0.1:8080", "https://museum.example", replaced));
  EXPECT_FALSE(request_allowed("127.0.0.1:8080", "http://museum.example", replaced));
  file.socket = "/run/lumigraft.sock";
  EXPECT_TRUE(request_allowed("museum.example", "https://museum.example", file)) << "no page reaches a file";
  EXPECT_FALSE(request_allowed("museum.example", "https://evil.example", file));
}

}  // namespace
}  // namespace lumigraft::server
