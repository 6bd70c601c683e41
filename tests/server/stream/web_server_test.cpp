#include "server/stream/web_server.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <latch>
#include <nlohmann/json.hpp>
#include <semaphore>
#include <thread>
#include <utility>

#include "tests/server/stream/stream_header.h"
#include "tests/server/stream/websocket_client.h"

namespace lumigraft::server {
namespace {

using std::chrono::milliseconds;

/// A server with a fake service that publishes a JPEG-kind message every 10 ms.
class WebServerTest : public testing::Test {
 protected:
  void start(const WebSettings& settings = {}, std::size_t picture_bytes = 1000) {
    WebHandlers handlers;
    handlers.get = [](std::string_view path) {
      return path == "/" ? WebReply{200, "text/html", "the page"} : WebReply{404, "text/plain", "none"};
    };
    handlers.snapshot = [this] {
      snapshot_begun_.count_down();
      EXPECT_TRUE(pictures_came_.try_acquire_for(std::chrono::seconds(10)));
      return WebReply{200, "image/jpeg", "a picture"};
    };
    handlers.hello = [](Permissions) { return std::string(R"({"type":"hello"})"); };
    handlers.state = [this] { return R"({"type":"state","moved":)" + std::to_string(moved_.load()) + "}"; };
    handlers.change_object = [this](const ObjectCommand& command) -> std::optional<std::string> {
      if (command.on_pixel) return "on_pixel: nothing is there";
      if (std::holds_alternative<std::size_t>(command.object) && std::get<std::size_t>(command.object) > 0) {
        return "object: there is one";
      }
      ++moved_;
      return std::nullopt;
    };
    handlers.record = [](bool) { return std::optional<std::string>("record: not here"); };
    handlers.playback = [](const PlaybackCommand&) { return std::optional<std::string>("playback: not here"); };
    web_ = std::make_unique<WebServer>(settings, handlers, demand_, metrics_);
    web_->start();
    camera_ = std::jthread([this, picture_bytes](const std::stop_token& stop) {
      const std::vector<std::uint8_t> payload(picture_bytes, 0x5a);
      for (std::uint32_t sequence = 1; !stop.stop_requested(); ++sequence) {
        StreamHeader header;
        header.kind = StreamKind::jpeg;
        header.sequence = sequence;
        web_->publish(make_stream_message(header, payload));
        std::this_thread::sleep_for(milliseconds(10));
      }
    });
  }
  void TearDown() override {
    camera_ = {};
    web_.reset();
  }
  std::uint16_t port() const { return web_->port(); }

  static void want(WebsocketClient& client) { client.send_text(R"({"type":"want","codec":"jpeg"})"); }
  static void expect_frames(WebsocketClient& client, int count) {
    for (int seen = 0; seen < count;) {
      const auto message = client.receive();
      ASSERT_TRUE(message);
      ASSERT_NE(message->opcode, 8) << message->close_code();
      seen += message->opcode == 2 ? 1 : 0;
    }
  }

  EncoderDemand demand_;
  Metrics metrics_;
  std::atomic<int> moved_ = 0;
  std::latch snapshot_begun_{1};
  std::binary_semaphore pictures_came_{0};
  std::unique_ptr<WebServer> web_;
  std::jthread camera_;
};

TEST_F(WebServerTest, HelloThenFramesThatWereRequested) {
  start();
  WebsocketClient client(port());
  ASSERT_TRUE(client.open());
  const auto hello = client.receive();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->payload, R"({"type":"hello"})");
  EXPECT_EQ(demand_.jpeg, 0);
  want(client);
  std::uint32_t last = 0;
  for (int i = 0; i < 5; ++i) {
    const auto message = client.receive();
    ASSERT_TRUE(message);
    ASSERT_EQ(message->opcode, 2);
    const auto header =
        parse_stream_header({reinterpret_cast<const std::uint8_t*>(message->payload.data()), message->payload.size()});
    ASSERT_TRUE(header);
    EXPECT_GT(header->sequence, last);
    last = header->sequence;
  }
  EXPECT_EQ(demand_.jpeg, 1);
  EXPECT_EQ(metrics_.viewers(), 1);
}

TEST_F(WebServerTest, PicturesGoOnWhileASnapshotIsEncoded) {
  start();
  WebsocketClient client(port());
  want(client);
  expect_frames(client, 1);
  std::string reply;
  std::jthread asks([&] { reply = http_get(port(), "/snapshot.jpg"); });
  snapshot_begun_.wait();
  expect_frames(client, 5);
  pictures_came_.release();
  asks.join();
  EXPECT_TRUE(reply.ends_with("a picture")) << reply;
}

TEST_F(WebServerTest, AChangeIsSentToAllViewers) {
  start();
  WebsocketClient one(port()), other(port());
  other.receive_text("hello");
  one.send_text(R"({"type":"object","index":0,"visible":false})");
  EXPECT_TRUE(other.receive_text(R"("moved":1)"));
  EXPECT_TRUE(one.receive_text(R"("moved":1)"));
}

TEST_F(WebServerTest, PagesAndRefusals) {
  start();
  EXPECT_NE(http_get(port(), "/").find("the page"), std::string::npos);
  EXPECT_NE(http_get(port(), "/?x=1").find("the page"), std::string::npos);
  EXPECT_EQ(http_get(port(), "/none").rfind("HTTP/1.1 404", 0), 0u);
  EXPECT_EQ(http_get(port(), "/ws").rfind("HTTP/1.1 426", 0), 0u);
  EXPECT_EQ(
      http_exchange(port(), "POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n").rfind("HTTP/1.1 405", 0),
      0u);
  EXPECT_EQ(http_exchange(port(), "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n").rfind("HTTP/1.1 403", 0), 0u);
  EXPECT_EQ(http_exchange(port(), "nonsense\r\n\r\n"), "");
  EXPECT_EQ(http_exchange(port(), "GET /" + std::string(100000, 'a') + " HTTP/1.1\r\n"), "");
  const std::string head = http_exchange(port(), "HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_NE(head.find("Content-Length: 8"), std::string::npos);
  EXPECT_EQ(head.find("the page"), std::string::npos);
  EXPECT_NE(WebsocketClient(port(), "Origin: http://evil.example\r\n").handshake_reply().find(" 403 "),
            std::string::npos);
  EXPECT_TRUE(WebsocketClient(port(), "Origin: http://localhost\r\n").open());
}

TEST_F(WebServerTest, AFirstBadMessageIsAnsweredASecondEndsTheStream) {
  start();
  WebsocketClient good(port()), bad(port());
  want(good);
  bad.send_text(R"({"type":"launch"})");
  EXPECT_TRUE(bad.receive_text(R"("type":"error")"));
  bad.send_text(R"({"type":"object","index":-3,"visible":true})");
  EXPECT_TRUE(bad.receive_text(R"("type":"error")"));
  const auto close = bad.receive();
  ASSERT_TRUE(close);
  EXPECT_EQ(close->close_code(), 1008);
  expect_frames(good, 5);
}

/// Commands that may fail for a well-behaved visitor: a touch that misses, or an object that an operator has removed.
TEST_F(WebServerTest, ObjectCommandsThatFailEndNoStream) {
  start();
  WebsocketClient viewer(port());
  want(viewer);
  for (const auto& [command, answer] :
       {std::pair(R"({"type":"object","index":0,"on_pixel":[3,4]})", "nothing is there"),
        std::pair(R"({"type":"object","index":3,"visible":true})", "there is one")}) {
    for (int i = 0; i < 4; ++i) {
      viewer.send_text(command);
      EXPECT_TRUE(viewer.receive_text(answer));
    }
  }
  expect_frames(viewer, 5);
}

TEST_F(WebServerTest, HostileFramesHarmNoOtherViewer) {
  start();
  WebsocketClient good(port());
  want(good);
  {
    WebsocketClient client(port());
    client.receive_text("hello");
    client.send_frame(1, "\xff\xfe\x80 not UTF-8");
    const auto close = client.receive();
    ASSERT_TRUE(close);
    EXPECT_EQ(close->close_code(), 1007);
  }
  {
    WebsocketClient client(port());
    client.receive_text("hello");
    client.send_frame(1, "x", std::uint64_t{1} << 62);  // header of a frame of four exabytes
    const auto close = client.receive();
    ASSERT_TRUE(close);
    EXPECT_EQ(close->close_code(), 1009);
  }
  {
    WebsocketClient client(port());
    client.receive_text("hello");
    for (int i = 0; i < 9; ++i) {
      client.send_frame(i == 0 ? 1 : 0, std::string(10000, 'a'), {}, false);  // fragments of a message that never ends
    }
    const auto close = client.receive();
    ASSERT_TRUE(close);
    EXPECT_EQ(close->close_code(), 1009);
  }
  {
    WebsocketClient client(port());
    client.send_frame(2, std::string(100, '\0'));
    EXPECT_TRUE(client.receive_text("JSON text"));
  }
  {
    WebsocketClient client(port());
    client.send_frame(11, "a reserved opcode");
    EXPECT_TRUE(client.closed_by_peer());
  }
  expect_frames(good, 20);
}

TEST_F(WebServerTest, AThousandConnectionsHarmNoViewer) {
  WebSettings settings;
  settings.max_connections = 50;
  start(settings);
  WebsocketClient good(port());
  want(good);
  expect_frames(good, 1);
  std::vector<int> sockets;
  for (int i = 0; i < 1000; ++i) {
    const int s = connect_to(port());
    if (s < 0) {
      break;  // this process ran out of descriptors
    }
    sockets.push_back(s);
    if (i % 100 == 0) {
      expect_frames(good, 1);
    }
  }
  EXPECT_GT(sockets.size(), 900u);
  expect_frames(good, 5);
  EXPECT_NE(http_get(port(), "/").find("the page"), std::string::npos) << "new requests are served meanwhile";
  for (const int s : sockets) {
    ::close(s);
  }
}

TEST_F(WebServerTest, OneViewerTooManyGetsAnError) {
  WebSettings settings;
  settings.max_viewers = 2;
  start(settings);
  {
    WebsocketClient one(port()), two(port()), three(port());
    EXPECT_TRUE(one.open());
    EXPECT_TRUE(two.open());
    EXPECT_NE(three.handshake_reply().find(" 503 "), std::string::npos);
  }
  for (int i = 0; i < 100 && metrics_.viewers() > 0; ++i) {
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_TRUE(WebsocketClient(port()).open()) << "who leaves makes room";
}

TEST_F(WebServerTest, AReaderThatNeverReadsIsLeftBehindAndThenCutOff) {
  WebSettings settings;
  settings.write_timeout = milliseconds(500);
  start(settings, 200'000);
  WebsocketClient good(port()), deaf(port());
  want(good);
  want(deaf);
  expect_frames(good, 1);
  for (int i = 0; i < 500 && metrics_.viewers() > 1; ++i) {
    ASSERT_TRUE(good.receive());
  }
  EXPECT_EQ(metrics_.viewers(), 1);
  expect_frames(good, 5);
}

TEST_F(WebServerTest, SilentConnectionsTimeOut) {
  WebSettings settings;
  settings.request_timeout = milliseconds(200);
  settings.silence_timeout = milliseconds(400);
  start(settings);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(http_exchange(port(), "GET / HT"), "");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  WebsocketClient dead(port());  // answers no ping
  EXPECT_TRUE(dead.open());
  EXPECT_TRUE(dead.closed_by_peer());
}

TEST_F(WebServerTest, StopSaysGoodbye) {
  start();
  WebsocketClient client(port());
  want(client);
  expect_frames(client, 2);
  camera_ = {};
  const auto begin = std::chrono::steady_clock::now();
  web_->stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(500));
  int code = -1;
  while (const auto message = client.receive(milliseconds(500))) {
    code = message->opcode == 8 ? message->close_code() : code;
  }
  EXPECT_EQ(code, 1001);
}

TEST(WebServerStart, APostIsAnsweredWhereSomethingIsToBeDone) {
  EncoderDemand demand;
  Metrics metrics;
  WebHandlers handlers;
  handlers.get = [](std::string_view) { return WebReply{200, "text/plain", "page"}; };
  handlers.post = [](std::string_view path) { return WebReply{200, "text/plain", "did " + std::string(path)}; };
  WebServer web({}, handlers, demand, metrics);
  web.start();
  const auto post = [&](const std::string& more) {
    return http_exchange(web.port(), "POST /finish?x=1 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + more +
                                         "Content-Length: 2\r\n\r\n{}");
  };
  EXPECT_NE(post("").find("did /finish"), std::string::npos);
  EXPECT_EQ(post("Origin: http://evil.example\r\n").rfind("HTTP/1.1 403", 0), 0u);
  EXPECT_NE(http_get(web.port(), "/").find("page"), std::string::npos);
}

TEST(WebServerStart, AnAddressInUseIsSaid) {
  EncoderDemand demand;
  Metrics metrics;
  const WebServer first({}, {}, demand, metrics);
  WebSettings same;
  same.listeners[0].port = first.port();
  try {
    const WebServer second(same, {}, demand, metrics);
    FAIL() << "two servers on one port";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("in use"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace lumigraft::server
