#include "tests/server/stream/websocket_client.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;

void send_all(int socket, const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t n = ::send(socket, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) {
      return;
    }
    sent += static_cast<std::size_t>(n);
  }
}

/// False at the end of the stream or after the deadline.
bool receive_some(int socket, std::string& into, Clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  pollfd p{socket, POLLIN, 0};
  if (poll(&p, 1, static_cast<int>(std::max<std::int64_t>(left, 0))) <= 0) {
    return false;
  }
  std::array<char, 65536> block;
  const ssize_t n = recv(socket, block.data(), block.size(), 0);
  if (n <= 0) {
    return false;
  }
  into.append(block.data(), static_cast<std::size_t>(n));
  return true;
}

}  // namespace

int connect_to(std::uint16_t port) {
  const int s = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(s, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    ::close(s);
    return -1;
  }
  return s;
}

std::string http_exchange(std::uint16_t port, const std::string& request) {
  const int s = connect_to(port);
  if (s < 0) {
    return {};
  }
  send_all(s, request);
  std::string reply;
  const Clock::time_point deadline = Clock::now() + std::chrono::seconds(10);
  while (receive_some(s, reply, deadline)) {
  }
  ::close(s);
  return reply;
}

std::string http_get(std::uint16_t port, const std::string& path) {
  return http_exchange(port, "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
}

int WebsocketClient::Message::close_code() const {
  return opcode == 8 && payload.size() >= 2
             ? (static_cast<unsigned char>(payload[0]) << 8 | static_cast<unsigned char>(payload[1]))
             : -1;
}

WebsocketClient::WebsocketClient(std::uint16_t port, const std::string& extra_header) : socket_(connect_to(port)) {
  if (socket_ < 0) {
    return;
  }
  send_all(socket_, "GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n" +
                        extra_header +
                        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  const Clock::time_point deadline = Clock::now() + std::chrono::seconds(10);
  std::size_t end = std::string::npos;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos && receive_some(socket_, buffer_, deadline)) {
  }
  reply_ = buffer_.substr(0, end);
  buffer_ = end == std::string::npos ? "" : buffer_.substr(end + 4);
  // The accept value for the key above (RFC 6455, section 1.3).
  open_ = reply_.find(" 101 ") != std::string::npos && reply_.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo=") != std::string::npos;
}

WebsocketClient::~WebsocketClient() {
  if (socket_ >= 0) {
    ::close(socket_);
  }
}

bool WebsocketClient::read_bytes(std::size_t count, std::string& out, Clock::time_point deadline) {
  while (buffer_.size() < count) {
    if (!receive_some(socket_, buffer_, deadline)) {
      return false;
    }
  }
  out = buffer_.substr(0, count);
  buffer_.erase(0, count);
  return true;
}

std::optional<WebsocketClient::Message> WebsocketClient::receive(std::chrono::milliseconds timeout) {
  const Clock::time_point deadline = Clock::now() + timeout;
  Message message;
  for (;;) {
    std::string head, extended, payload;
    if (!read_bytes(2, head, deadline)) {
      return std::nullopt;
    }
    const int opcode = head[0] & 0x0f;
    std::uint64_t length = head[1] & 0x7f;
    if (length >= 126) {
      const std::size_t bytes = length == 126 ? 2 : 8;
      if (!read_bytes(bytes, extended, deadline)) {
        return std::nullopt;
      }
      length = 0;
      for (const char c : extended) {
        length = length << 8 | static_cast<unsigned char>(c);
      }
    }
    if (!read_bytes(length, payload, deadline)) {
      return std::nullopt;
    }
    if (opcode == 9) {
      send_frame(10, payload);
      continue;
    }
    if (opcode == 10) {
      continue;
    }
    message.opcode = opcode == 0 ? message.opcode : opcode;
    message.payload += payload;
    if ((head[0] & 0x80) != 0) {
      return message;
    }
  }
}

std::optional<std::string> WebsocketClient::receive_text(const std::string& part) {
  while (const std::optional<Message> message = receive()) {
    if (message->opcode == 1 && message->payload.find(part) != std::string::npos) {
      return message->payload;
    }
  }
  return std::nullopt;
}

void WebsocketClient::send_frame(int opcode, const std::string& payload, std::optional<std::uint64_t> claimed_length,
                                 bool final_frame) {
  std::string frame(1, static_cast<char>((final_frame ? 0x80 : 0) | opcode));
  const std::uint64_t length = claimed_length.value_or(payload.size());
  const int bytes = length < 126 ? 0 : (length < 65536 ? 2 : 8);
  frame += static_cast<char>(0x80 | (bytes == 0 ? length : (bytes == 2 ? 126 : 127)));
  for (int i = bytes - 1; i >= 0; --i) {
    frame += static_cast<char>(length >> (8 * i));
  }
  frame += std::string(4, '\0');  // a zero mask leaves the payload unchanged
  send_all(socket_, frame + payload);
}

bool WebsocketClient::closed_by_peer(std::chrono::milliseconds timeout) {
  const Clock::time_point deadline = Clock::now() + timeout;
  while (Clock::now() < deadline) {
    pollfd p{socket_, POLLIN, 0};
    if (poll(&p, 1, 100) <= 0) {
      continue;
    }
    std::array<char, 65536> block;
    if (recv(socket_, block.data(), block.size(), 0) <= 0) {
      return true;
    }
  }
  return false;
}

}  // namespace lumigraft::server
