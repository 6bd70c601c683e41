// Fuzz targets of what the service reads: its configuration, and what clients send.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

#include "server/metrics/metrics.h"
#include "server/pipeline/service_config.h"
#include "server/stream/protocol.h"
#include "server/stream/web_server.h"
#include "tests/fuzz/expect_answer.h"
#include "tests/fuzz/targets.h"

namespace lumigraft::fuzz {
namespace {

using server::WebReply;

/// A web server on a Unix socket, with handlers that accept everything.
class Service {
 public:
  Service() {
    server::WebSettings settings;
    settings.listeners[0].socket = socket_;
    settings.request_timeout = std::chrono::seconds(2);
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
    web_ = std::make_unique<server::WebServer>(settings, handlers, demand_, metrics_);
    web_->start();
  }

  /// Sends the bytes and reads until the service closes. Throws where it answers nothing at all for 10 s.
  void converse(std::string_view bytes) const {
    const int client = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un to{.sun_family = AF_UNIX, .sun_path = {}};
    socket_.native().copy(to.sun_path, sizeof to.sun_path - 1);
    const timeval patience{.tv_sec = 10, .tv_usec = 0};
    ::setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    bool closed = false;
    if (::connect(client, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
      ::send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      ::shutdown(client, SHUT_WR);
      std::array<char, 4096> reply{};
      ssize_t size = 0;
      do {
        size = ::recv(client, reply.data(), reply.size(), 0);
      } while (size > 0 || (size < 0 && errno == EINTR));  // libFuzzer has a timer
      closed = size == 0 || errno == ECONNRESET;
    }
    ::close(client);
    if (!closed) throw std::runtime_error("the service did not end a connection whose client has ended it");
  }

 private:
  const std::filesystem::path socket_ =
      std::filesystem::temp_directory_path() / ("fuzz_" + std::to_string(::getpid()) + ".socket");
  server::EncoderDemand demand_;
  server::Metrics metrics_;
  std::unique_ptr<server::WebServer> web_;  // last: its thread uses the members above
};

const Service& running_service() {
  static const Service service;
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
