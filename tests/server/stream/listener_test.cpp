// A web server with several listeners: what viewers of each may do, who is let in, encryption.
#include "server/stream/listener.h"

#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>

#include "server/stream/web_server.h"
#include "tests/server/stream/test_certificate.h"
#include "tests/server/stream/websocket_client.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

constexpr const char* kToken = "0123456789abcdef";

class ListenerTest : public testing::Test {
 protected:
  void start(std::vector<ListenerSettings> listeners, int max_viewers = 64) {
    WebHandlers handlers;
    handlers.get = [](std::string_view path) {
      if (path == "/fails") throw std::runtime_error("a handler that fails");
      if (path == "/login.html")
        return WebReply{.body = R"(this is /login.html <p id="login-wrong" hidden><p id="login-wait" hidden>)"};
      return WebReply{.status = 200, .type = "text/html", .body = "this is " + std::string(path)};
    };
    handlers.hello = [](Permissions may) { return "hello of " + std::to_string(may.names().size()); };
    handlers.state = [] { return std::string("state"); };
    handlers.change_object = [this](const ObjectCommand& command) -> std::optional<std::string> {
      if (std::holds_alternative<std::string>(command.object)) throw std::runtime_error("a handler that fails");
      ++moved_;
      return std::nullopt;
    };
    handlers.save = [this] { return std::string(++saved_ == 1 ? "" : "the disk is full"); };
    handlers.record = [this](bool) -> std::optional<std::string> {
      ++recorded_;
      return std::nullopt;
    };
    handlers.playback = [](const PlaybackCommand&) { return std::optional<std::string>("playback: not here"); };
    web_ = std::make_unique<WebServer>(WebSettings{.listeners = std::move(listeners), .max_viewers = max_viewers},
                                       handlers, demand_, metrics_);
    web_->start();
  }
  std::string get(std::size_t listener, const std::string& path, const std::string& header = "") {
    return http_exchange(web_->port(listener),
                         "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + header + "\r\n");
  }
  std::string log_in(const std::string& body) {
    return http_exchange(web_->port(), "POST /login HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" +
                                           ("Content-Length: " + std::to_string(body.size())) + "\r\n\r\n" + body);
  }

  const TinySession tiny_{"listener"};
  EncoderDemand demand_;
  Metrics metrics_;
  std::atomic<int> moved_ = 0, recorded_ = 0, saved_ = 0;
  std::unique_ptr<WebServer> web_;
};

TEST_F(ListenerTest, CommandsNeedPermission) {
  ListenerSettings all, look;
  look.permissions = {Permission::view};
  start({all, look});
  WebsocketClient one(web_->port(0)), two(web_->port(1));
  EXPECT_TRUE(one.receive_text("hello of 4"));
  EXPECT_TRUE(two.receive_text("hello of 1"));
  for (int i = 0; i < 3; ++i) {
    two.send_text(R"({"type":"object","index":0,"visible":false})");
    EXPECT_TRUE(two.receive_text("permit")) << i;
  }
  two.send_text(R"({"type":"record","on":true})");
  EXPECT_TRUE(two.receive_text("permit"));
  two.send_text(R"({"type":"save"})");
  EXPECT_TRUE(two.receive_text("permit"));
  EXPECT_EQ(moved_ + recorded_ + saved_, 0);
  one.send_text(R"({"type":"save"})");
  EXPECT_TRUE(one.receive_text(R"({"error":"","type":"saved"})"));
  for (int i = 0; i < 3; ++i) {
    one.send_text(R"({"type":"save"})");
    EXPECT_TRUE(one.receive_text(R"({"error":"the disk is full","type":"saved"})")) << "a viewer is not to blame";
  }
  one.send_text(R"({"type":"object","index":0,"visible":false})");
  EXPECT_TRUE(one.receive_text("state"));
  EXPECT_EQ(moved_, 1);
  EXPECT_TRUE(two.receive_text("state")) << "all see what one did";
  EXPECT_NE(get(0, "/metrics").find(" 200 "), std::string::npos);
  EXPECT_NE(get(1, "/metrics").find(" 403 "), std::string::npos);
  EXPECT_NE(get(1, "/").find(" 200 "), std::string::npos);
}

TEST_F(ListenerTest, AFloodOfCommandsIsThinned) {
  start({ListenerSettings{}});
  WebsocketClient one(web_->port());
  for (int i = 0; i < 500; ++i) one.send_text(R"({"type":"object","index":0,"visible":true})");
  EXPECT_TRUE(one.receive_text("too many commands"));
  EXPECT_LT(moved_, 150);
  EXPECT_GE(moved_, 60);
}

TEST_F(ListenerTest, ReservedPlacesAreKept) {
  ListenerSettings kiosk, far;
  kiosk.reserved_viewers = 1;
  start({kiosk, far}, 3);
  const WebsocketClient one(web_->port(1)), two(web_->port(1)), three(web_->port(1));
  EXPECT_TRUE(one.open() && two.open());
  EXPECT_NE(three.handshake_reply().find(" 503 "), std::string::npos);
  EXPECT_TRUE(WebsocketClient(web_->port(0)).open());
}

TEST_F(ListenerTest, ATokenIsNeeded) {
  ListenerSettings secret, open;
  secret.token = kToken;
  start({secret, open});
  EXPECT_NE(get(0, "/").find("Location: /login"), std::string::npos);
  EXPECT_NE(get(0, "/snapshot.jpg").find(" 401 "), std::string::npos);
  EXPECT_EQ(get(0, "/main.js").find("this is"), std::string::npos);
  for (const char* of_the_form : {"/style.css", "/text.js", "/texts.js"})
    EXPECT_NE(get(0, of_the_form).find("this is"), std::string::npos) << of_the_form;
  EXPECT_NE(get(0, "/login").find("this is /login.html"), std::string::npos);
  EXPECT_NE(get(0, "/healthz").find(" 200 "), std::string::npos);
  EXPECT_NE(get(1, "/snapshot.jpg").find(" 200 "), std::string::npos);
  EXPECT_FALSE(WebsocketClient(web_->port(0)).open());
  EXPECT_NE(get(0, "/", std::string("Authorization: Bearer ") + kToken + "\r\n").find("this is /"), std::string::npos);
  EXPECT_TRUE(WebsocketClient(web_->port(0), std::string("Authorization: Bearer ") + kToken + "\r\n").open());

  EXPECT_NE(log_in("token=wrong").find("Location: /login?wrong"), std::string::npos);
  EXPECT_NE(get(0, "/login?wrong").find(R"(<p id="login-wrong"><p id="login-wait" hidden>)"), std::string::npos);
  EXPECT_NE(get(0, "/login").find(R"(<p id="login-wrong" hidden><p id="login-wait" hidden>)"), std::string::npos);
  const std::string in = log_in(std::string("token=") + kToken);
  const std::size_t at = in.find("Set-Cookie: ");
  ASSERT_NE(at, std::string::npos) << in;
  const std::string cookie = in.substr(at + 12, in.find(';', at) - at - 12);
  EXPECT_NE(in.find("HttpOnly; SameSite=Strict"), std::string::npos);
  EXPECT_NE(get(0, "/", "Cookie: " + cookie + "\r\n").find("this is /"), std::string::npos);
  EXPECT_TRUE(WebsocketClient(web_->port(0), "Cookie: " + cookie + "\r\n").open());
  for (int i = 0; i < 10; ++i) log_in("token=guess");
  const std::string refused = log_in(std::string("token=") + kToken);
  EXPECT_NE(refused.find(" 429 "), std::string::npos);
  EXPECT_NE(refused.find(R"(<p id="login-wrong" hidden><p id="login-wait">)"), std::string::npos)
      << "the form says why";
}

TEST_F(ListenerTest, PermissionsAndTokensChangeWhileItRuns) {
  ListenerSettings one, other;
  one.token = kToken;
  start({one, other});
  const std::string token = std::string("Authorization: Bearer ") + kToken + "\r\n";
  WebsocketClient secret(web_->port(0), token), open(web_->port(1));
  EXPECT_TRUE(secret.receive_text("hello of 4"));
  EXPECT_TRUE(open.receive_text("hello of 4"));
  other.permissions = {Permission::view};
  EXPECT_TRUE(web_->change_listeners({one, other}).empty());
  web_->greet();
  EXPECT_TRUE(open.receive_text("hello of 1"));
  open.send_text(R"({"type":"object","index":0,"visible":false})");
  EXPECT_TRUE(open.receive_text("permit"));
  secret.send_text(R"({"type":"object","index":0,"visible":false})");
  EXPECT_TRUE(secret.receive_text("state")) << "nothing changed for it";

  one.token = "fedcba9876543210";
  EXPECT_TRUE(web_->change_listeners({one, other}).empty());
  EXPECT_TRUE(secret.closed_by_peer()) << "it knows the former token only";
  EXPECT_FALSE(WebsocketClient(web_->port(0), token).open());
  EXPECT_TRUE(WebsocketClient(web_->port(0), "Authorization: Bearer fedcba9876543210\r\n").open());
  web_->greet();
  EXPECT_TRUE(open.receive_text("hello of 1")) << "the others go on";

  other.permissions = {};
  web_->change_listeners({one, other});
  EXPECT_TRUE(open.closed_by_peer()) << "nobody may view there";
}

TEST_F(ListenerTest, WhatCannotChangeIsSaidAndChangesNothing) {
  ListenerSettings one, elsewhere;
  start({one});
  elsewhere.address = "127.0.0.7";
  const std::vector<std::string> said = web_->change_listeners({elsewhere});
  ASSERT_EQ(said.size(), 2u);
  EXPECT_NE(said[0].find("not in the configuration any more"), std::string::npos);
  EXPECT_NE(said[1].find("127.0.0.7"), std::string::npos);
  one.permissions = {};
  one.certificate = one.key = tiny_.folder / "absent.pem";
  EXPECT_THROW(web_->change_listeners({one}), std::runtime_error);
  EXPECT_NE(get(0, "/").find(" 200 "), std::string::npos);
}

TEST_F(ListenerTest, AHandlerThatFailsEndsItsConnectionAlone) {
  start({ListenerSettings{}});
  WebsocketClient viewer(web_->port()), other(web_->port());
  EXPECT_NE(get(0, "/fails").find(" 500 "), std::string::npos);
  EXPECT_NE(get(0, "/works").find("this is /works"), std::string::npos);
  viewer.send_text(R"({"type":"object","name":"fails","visible":true})");
  EXPECT_TRUE(viewer.closed_by_peer());
  other.send_text(R"({"type":"object","index":0,"visible":true})");
  EXPECT_TRUE(other.receive_text("state"));
}

TEST_F(ListenerTest, PagesOfOthersDoNotFrameIt) {
  ListenerSettings framed;
  framed.allowed_origins = {"https://museum.example"};
  start({ListenerSettings{}, framed});
  EXPECT_NE(get(0, "/").find("frame-ancestors 'self'\r\n"), std::string::npos);
  EXPECT_NE(get(1, "/").find("frame-ancestors 'self' https://museum.example\r\n"), std::string::npos);
}

TEST_F(ListenerTest, AUnixSocket) {
  ListenerSettings file;
  file.socket = tiny_.folder / "page.sock";
  start({file});
  const auto exchange = [&] {
    const int s = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    file.socket.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
    std::string reply;
    if (::connect(s, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {
      const std::string request = "GET / HTTP/1.1\r\nHost: museum.example\r\nConnection: close\r\n\r\n";
      EXPECT_EQ(::send(s, request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
      std::array<char, 4096> block;
      for (ssize_t n = 0; (n = ::recv(s, block.data(), block.size(), 0)) > 0;)
        reply.append(block.data(), static_cast<std::size_t>(n));
    }
    ::close(s);
    return reply;
  };
  EXPECT_NE(exchange().find("this is /"), std::string::npos);
  EncoderDemand demand;
  Metrics metrics;
  EXPECT_THROW(WebServer(WebSettings{.listeners = {file}}, {}, demand, metrics), std::runtime_error) << "in use";
  web_.reset();
  EXPECT_FALSE(std::filesystem::exists(file.socket)) << "removed at the end";
  std::ofstream(file.socket) << "somebody's notes";
  EXPECT_THROW(start({file}), std::runtime_error);
  EXPECT_TRUE(std::filesystem::exists(file.socket)) << "no socket is replaced";
}

/// One request over TLS; empty where the handshake fails.
std::string get_encrypted(std::uint16_t port, const std::filesystem::path& trusted) {
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  SSL_CTX_load_verify_locations(context.get(), trusted.c_str(), nullptr);
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  const std::unique_ptr<SSL, void (*)(SSL*)> tls(SSL_new(context.get()), SSL_free);
  const int socket = connect_to(port);
  SSL_set_fd(tls.get(), socket);
  std::string reply;
  if (SSL_connect(tls.get()) == 1) {
    const std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    SSL_write(tls.get(), request.data(), static_cast<int>(request.size()));
    std::array<char, 4096> block;
    for (int n = 0; (n = SSL_read(tls.get(), block.data(), static_cast<int>(block.size()))) > 0;)
      reply.append(block.data(), static_cast<std::size_t>(n));
  }
  ::close(socket);
  return reply;
}

TEST_F(ListenerTest, Encrypted) {
  ListenerSettings https;
  https.certificate = tiny_.folder / "page.crt";
  https.key = tiny_.folder / "page.key";
  write_test_certificate(https.certificate, https.key, "localhost", 90);
  start({https});
  EXPECT_NE(get_encrypted(web_->port(), https.certificate).find("this is /"), std::string::npos);
  EXPECT_EQ(get(0, "/"), "") << "http on an https port";
  EXPECT_NE(get_encrypted(web_->port(), https.certificate).find("this is /"), std::string::npos);

  EncoderDemand demand;
  Metrics metrics;
  std::ofstream(tiny_.folder / "none.key") << "not a key";
  https.key = tiny_.folder / "none.key";
  https.port = 0;
  try {
    const WebServer refused(WebSettings{.listeners = {https}}, {}, demand, metrics);
    FAIL() << "a key that is none";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("none.key"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace lumigraft::server
