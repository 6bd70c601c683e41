#pragma once
// The HTTP and websocket server of docs/protocol.md, on its own thread (Boost.Beast). Resources per viewer are bounded:
// see "Limits" in docs/protocol.md.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/metrics/metrics.h"
#include "server/stream/listener.h"
#include "server/stream/network_rate.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

struct WebSettings {
  std::vector<ListenerSettings> listeners{1};
  int max_viewers = 64;       ///< of all listeners together
  int max_connections = 256;  ///< beyond it, the oldest connection without a stream is closed
  RateLimits rate = {};       ///< of H.264
  std::size_t max_message_bytes = 64 * 1024;
  std::chrono::milliseconds request_timeout{10'000};
  std::chrono::milliseconds write_timeout{10'000};
  std::chrono::milliseconds silence_timeout{30'000};  ///< a ping is sent after half of it
};

struct WebReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};  ///< beside those of every reply
  std::string connects_to = {};  ///< an origin beside this one that the page may connect to
};

/// What becomes of a file that a client with the permission `admin` sends, PUT /models/NAME, or removes, DELETE.
struct UploadHandlers {
  struct Place {
    std::filesystem::path file;  ///< that does not exist yet; removed if it is still there after `received`
    std::uint64_t max_bytes = 0;
  };
  /// Where to write it, or why it is not taken. `bytes`: as announced, if it was. On the server's thread.
  std::function<std::variant<Place, WebReply>(std::string_view name, std::optional<std::uint64_t> bytes)> begin;
  /// Takes the file. On the thread that writes files.
  std::function<WebReply(const std::filesystem::path& file, std::string_view name)> received;
  /// Removes what was received by this name before. On the thread that writes files.
  std::function<WebReply(std::string_view name)> remove;
};

/// Callbacks into the service, called on the server's thread unless documented otherwise. If one throws, a request is
/// answered with 500, and a viewer's connection is closed.
struct WebHandlers {
  std::function<WebReply(std::string_view path)> get;
  /// GET /snapshot.jpg. On a thread of its own, one at a time: to encode a picture takes milliseconds, in which viewers
  /// would get none. Null: `get` answers.
  std::function<WebReply()> snapshot = nullptr;
  std::function<WebReply(std::string_view path)> post = nullptr;  ///< null: POST is not answered
  std::optional<UploadHandlers> upload = {};                      ///< none: nothing can be sent
  std::function<std::string(Permissions)> hello;                  ///< JSON text for a new viewer
  std::function<std::string()> state;                             ///< JSON text, sent after objects changed
  std::function<std::optional<std::string>(const ObjectCommand&)> change_object;  ///< returns what is wrong
  std::function<std::optional<std::string>(bool on)> record;                      ///< returns what is wrong
  std::function<std::optional<std::string>(const PlaybackCommand&)> playback;     ///< returns what is wrong
  std::function<std::string()> save;  ///< returns what is wrong, for viewers; empty: nothing
};

class WebServer {
 public:
  /// Binds and listens; throws std::runtime_error where an address cannot be bound or a certificate cannot be read.
  WebServer(const WebSettings& settings, WebHandlers handlers, EncoderDemand& demand, Metrics& metrics);
  ~WebServer();

  /// Of the listener with this index; 0: a Unix socket.
  std::uint16_t port(std::size_t listener = 0) const;
  void start();
  /// Takes over permissions, names, reserved places, tokens and certificates of listeners at the same addresses.
  /// Viewers of one whose token changed, or where nobody may view any more, are closed; the others go on. Returns what
  /// does not take effect: other addresses. Throws std::runtime_error where a certificate cannot be read; then nothing
  /// changes. Any one thread.
  std::vector<std::string> change_listeners(const std::vector<ListenerSettings>& listeners);
  /// Sends `hello` again to every viewer, as after objects came or went. Thread-safe.
  void greet();
  /// Sends to every viewer that requests this kind. Thread-safe.
  void publish(std::shared_ptr<const StreamMessage> message);
  /// Sends to every viewer; replaces a queued text of the same kind. Thread-safe.
  void publish_text(const std::string& kind, std::string text);
  /// When the thread last ran what was posted to it; each call posts. Any thread.
  std::chrono::steady_clock::time_point last_turn();
  /// Closes all websockets and ends the thread, within a fraction of a second.
  void stop();

  struct State;  ///< web_server_state.h

 private:
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
