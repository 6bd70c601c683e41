#pragma once
// HTTP and the websocket of docs/protocol.md, on one thread of its own (Boost.Beast). What viewers do to it is bounded:
// see "Limits" in docs/protocol.md.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/metrics/metrics.h"
#include "server/stream/encoder_demand.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

struct WebSettings {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: any free one
  int max_viewers = 64;
  int max_connections = 256;  ///< the oldest without a stream goes when one more comes
  std::size_t max_message_bytes = 64 * 1024;
  std::chrono::milliseconds request_timeout{10'000};
  std::chrono::milliseconds write_timeout{10'000};
  std::chrono::milliseconds silence_timeout{30'000};  ///< pings go out after half of it
};

struct WebReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

/// What the server asks of the service; all called on the server's thread.
struct WebHandlers {
  std::function<WebReply(std::string_view path)> get;
  std::function<WebReply(std::string_view path)> post = nullptr;                  ///< null: nothing is done by request
  std::function<std::string()> hello;                                             ///< JSON text for a new viewer
  std::function<std::string()> state;                                             ///< JSON text, after objects changed
  std::function<std::optional<std::string>(const ObjectCommand&)> change_object;  ///< returns what is wrong
  std::function<std::optional<std::string>(bool on)> record;                      ///< returns what is wrong
  std::function<std::optional<std::string>(const PlaybackCommand&)> playback;     ///< returns what is wrong
};

class WebServer {
 public:
  /// Binds and listens; throws std::runtime_error where the address cannot be had.
  WebServer(const WebSettings& settings, WebHandlers handlers, EncoderDemand& demand, Metrics& metrics);
  ~WebServer();

  std::uint16_t port() const;
  void start();
  /// To every viewer that wants its kind. Any thread.
  void publish(std::shared_ptr<const StreamMessage> message);
  /// To every viewer; a newer text of the same kind replaces one that waits. Any thread.
  void publish_text(const std::string& kind, std::string text);
  /// Says goodbye to viewers and ends the thread, within a fraction of a second.
  void stop();

  struct State;  ///< of web_server.cpp

 private:
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
