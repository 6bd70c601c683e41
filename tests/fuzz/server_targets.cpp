// Fuzz targets of what the service reads: its configuration, and what clients send.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/generic/stream_protocol.hpp>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <string>

#include "server/metrics/metrics.h"
#include "server/pipeline/service_config.h"
#include "server/stream/protocol.h"
#include "server/stream/web_server_state.h"
#include "tests/fuzz/expect_answer.h"
#include "tests/fuzz/targets.h"

namespace lumigraft::fuzz {
namespace {

using server::WebReply;
using Socket = boost::asio::generic::stream_protocol::socket;

/// Both ends of a connection.
struct SocketPair {
  std::array<int, 2> ends{};

  SocketPair() {
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw std::runtime_error("no pair of sockets");
  }
};

/// A web server whose handlers accept everything. It runs on this thread, as long as somebody speaks to it: between two
/// threads each conversation has several hand-overs, which take a second where other programs use the processor.
class Service {
 public:
  Service() : state_(settings(), handlers(), demand_, metrics_) {
    std::filesystem::remove(state_.listeners.front().settings.socket);  // nobody connects there
    state_.look_at_networks();
  }

  /// Sends the bytes and reads until the service closes. Throws where it does not for 10 s.
  void converse(std::string_view bytes) {
    const SocketPair sockets;
    const int client = sockets.ends[0];
    state_.admit(state_.listeners.front(), Socket(state_.io, {AF_UNIX, 0}, sockets.ends[1]), "");
    ::send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    ::shutdown(client, SHUT_WR);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    std::array<char, 4096> reply{};
    bool closed = false;
    while (!closed && std::chrono::steady_clock::now() < end) {
      state_.io.run_one_for(std::chrono::milliseconds(10));
      const ssize_t size = ::recv(client, reply.data(), reply.size(), MSG_DONTWAIT);
      closed = size == 0 || (size < 0 && errno == ECONNRESET);
    }
    ::close(client);
    state_.io.poll();  // what is left of this connection
    if (!closed) throw std::runtime_error("the service did not end a connection whose client has ended it");
  }

 private:
  static server::WebSettings settings() {
    server::WebSettings settings;
    settings.listeners[0].socket =
        std::filesystem::temp_directory_path() / ("fuzz_" + std::to_string(::getpid()) + ".socket");
    return settings;
  }

  static server::WebHandlers handlers() {
    server::WebHandlers handlers;
    handlers.get = [](std::string_view path) {
      return path == "/" ? WebReply{.status = 200, .body = "page"} : WebReply{.status = 404, .body = ""};
    };
    handlers.post = [](std::string_view) { return WebReply{.status = 200, .body = ""}; };
    handlers.hello = [](server::Permissions) { return std::string(R"({"type":"hello"})"); };
    handlers.state = [] { return std::string(R"({"type":"state"})"); };
    handlers.change_object = [](const server::ObjectCommand&) { return std::optional<std::string>(); };
    handlers.record = [](bool) { return std::optional<std::string>(); };
    handlers.save = [] { return std::string(); };
    handlers.playback = [](const server::PlaybackCommand&) { return std::optional<std::string>(); };
    return handlers;
  }

  server::EncoderDemand demand_;
  server::Metrics metrics_;
  server::WebServer::State state_;
};

Service& running_service() {
  static Service service;
  return service;
}

}  // namespace

void service(Bytes bytes) {
  expect_answer([&] {
    server::read_service({.config = file_with(bytes), .session = {}, .exhibit = {}, .overrides = {}},
                         server::interactive_plan());
  });
}

void command(Bytes bytes) {
  const server::Command parsed = server::parse_command(text_of(bytes));
  if (const auto* bad = std::get_if<server::BadCommand>(&parsed)) server::error_message(bad->error);
}

void http(Bytes bytes) { running_service().converse(text_of(bytes)); }

void websocket(Bytes bytes) {
  running_service().converse(
      "GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n" +
      std::string(text_of(bytes)));
}

}  // namespace lumigraft::fuzz
