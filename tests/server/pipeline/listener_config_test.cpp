#include "server/pipeline/listener_config.h"

#include <gtest/gtest.h>

#include "capture/error.h"
#include "tests/server/stream/test_certificate.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

std::vector<ListenerSettings> listeners_of(const std::filesystem::path& folder, int max_viewers = 64) {
  const capture::ConfigTable root = capture::ConfigTable::load(folder / "kiosk.toml");
  auto listeners = read_listeners(root.table("server"), max_viewers);
  root.finish();
  return listeners;
}

TEST(ListenerConfig, Addresses) {
  EXPECT_EQ(listener_at("[::1]:0", "--listen").address, "::1");
  EXPECT_EQ(listener_at("localhost:81", "--listen").address, "127.0.0.1");
  EXPECT_EQ(listener_at("localhost:81", "--listen").port, 81);
  EXPECT_EQ(listener_at("unix:/run/lumigraft/page.sock", "--listen").socket, "/run/lumigraft/page.sock");
  for (const std::string wrong :
       {"8080", "kiosk:80", "::1:80", "127.0.0.1:99999", "unix:", ("unix:/" + std::string(200, 'a')).c_str()})
    EXPECT_THROW(listener_at(wrong, "--listen"), capture::InputError) << wrong;
}

TEST(ListenerConfig, FromOtherMachinesOnlyViewUnlessSaid) {
  for (const char* local : {"127.0.0.1:0", "[::1]:0", "unix:a.sock"})
    EXPECT_EQ(listener_at(local, "").permissions, Permissions::all()) << local;
  for (const char* far : {"0.0.0.0:0", "10.0.0.1:0", "[::]:0"})
    EXPECT_EQ(listener_at(far, "").permissions, Permissions{Permission::view}) << far;
}

TEST(ListenerConfig, Several) {
  const TinySession tiny("listeners");
  tiny.write("token", "0123456789abcdef0123456789abcdef\nand a note\n");
  tiny.write("kiosk.toml", R"([server]
[[server.listener]]
listen = "127.0.0.1:8080"
reserved_viewers = 2
[[server.listener]]
listen = "0.0.0.0:8081"
permissions = ["view", "control"]
allowed_hosts = ["museum.example"]
allowed_origins = ["https://museum.example"]
token_file = "token"
)");
  const auto listeners = listeners_of(tiny.folder);
  ASSERT_EQ(listeners.size(), 2u);
  EXPECT_EQ(listeners[0].reserved_viewers, 2);
  EXPECT_EQ(listeners[0].permissions, Permissions::all());
  EXPECT_EQ(listeners[1].permissions.names(), (std::vector<std::string>{"view", "control"}));
  EXPECT_EQ(listeners[1].allowed_hosts, std::vector<std::string>{"museum.example"});
  EXPECT_EQ(listeners[1].token, "0123456789abcdef0123456789abcdef");
  const auto warnings = listener_warnings(listeners);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("unencrypted"), std::string::npos) << warnings[0];
}

TEST(ListenerConfig, CertificatesThatEndSoonAreSaid) {
  const TinySession tiny("listener-certificates");
  ListenerSettings https = listener_at("0.0.0.0:443", "");
  https.certificate = tiny.folder / "page.crt";
  https.key = tiny.folder / "page.key";
  const auto warned = [&](int days) {
    write_test_certificate(https.certificate, https.key, "museum.example", days);
    const auto warnings = listener_warnings({https});
    return warnings.empty() ? std::string() : warnings[0];
  };
  EXPECT_EQ(warned(60), "");
  EXPECT_NE(warned(5).find("ends in 5 days"), std::string::npos) << warned(5);
  EXPECT_NE(warned(-2).find("has ended"), std::string::npos) << warned(-2);
}

TEST(ListenerConfig, ErrorsSayWhere) {
  const TinySession tiny("listener-errors");
  tiny.write("short", "secret\n");
  const auto error_of = [&](const std::string& text, int max_viewers = 64) {
    tiny.write("kiosk.toml", text);
    try {
      listeners_of(tiny.folder, max_viewers);
    } catch (const capture::InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string one = "[[server.listener]]\nlisten = \"127.0.0.1:0\"\n";
  for (const auto& [line, key] : std::vector<std::pair<std::string, std::string>>{
           {"permissions = [\"look\"]", "permissions"},
           {"permissions = \"view\"", "permissions"},
           {"allowed_hosts = [\"museum.example:80\"]", "allowed_hosts"},
           {"allowed_origins = [\"museum.example\"]", "allowed_origins"},
           {"allowed_origins = [\"https://a.example/page\"]", "allowed_origins"},
           {"certificate = \"kiosk.toml\"", "certificate"},
           {"key = \"kiosk.toml\"", "key"},
           {"token_file = \"none\"", "token_file"},
           {"token_file = \"short\"", "token_file"},
           {"token = \"in the open\"", "token"}}) {
    const std::string error = error_of(one + line + "\n");
    EXPECT_NE(error.find(key), std::string::npos) << line << ": " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_NE(error_of("[server]\nlisten = \":1\"\n" + one).find("one of the two"), std::string::npos);
  EXPECT_NE(error_of(one + "reserved_viewers = 3\n", 2).find("max_viewers"), std::string::npos);
}

}  // namespace
}  // namespace lumigraft::server
