#pragma once
// A websocket client on plain sockets, so that tests can also send malformed data.
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace lumigraft::server {

/// Connects to 127.0.0.1 with a receive timeout. -1 where refused.
int connect_to(std::uint16_t port);

/// One HTTP exchange on a new socket; returns the whole reply.
std::string http_exchange(std::uint16_t port, const std::string& request);
std::string http_get(std::uint16_t port, const std::string& path);

class WebsocketClient {
 public:
  explicit WebsocketClient(std::uint16_t port, const std::string& extra_header = "");
  WebsocketClient(const WebsocketClient&) = delete;
  WebsocketClient& operator=(const WebsocketClient&) = delete;
  ~WebsocketClient();

  bool open() const { return open_; }
  const std::string& handshake_reply() const { return reply_; }

  struct Message {
    int opcode = 0;  ///< 1 text, 2 binary, 8 close
    std::string payload;
    int close_code() const;
  };
  /// The next complete message; answers pings. Empty after the timeout, or where the socket is closed.
  std::optional<Message> receive(std::chrono::milliseconds timeout = std::chrono::seconds(10));
  /// The next text message that contains `part`; skips others.
  std::optional<std::string> receive_text(const std::string& part);

  void send_text(const std::string& text) { send_frame(1, text); }
  /// Sends a masked frame; `claimed_length` puts a wrong length into its header.
  void send_frame(int opcode, const std::string& payload, std::optional<std::uint64_t> claimed_length = {},
                  bool final_frame = true);
  bool closed_by_peer(std::chrono::milliseconds timeout = std::chrono::seconds(10));

 private:
  bool read_bytes(std::size_t count, std::string& out, std::chrono::steady_clock::time_point deadline);

  int socket_;
  bool open_ = false;
  std::string reply_, buffer_;
};

}  // namespace lumigraft::server
