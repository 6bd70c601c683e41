#pragma once
// What the connections of a web server share. All of it is used on the server's thread alone.
#include <array>
#include <atomic>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <chrono>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "server/stream/connection.h"
#include "server/stream/login.h"
#include "server/stream/web_server.h"

namespace lumigraft::server {

/// One place where the server listens.
struct Listener {
  using Tcp = boost::asio::ip::tcp::acceptor;
  using Unix = boost::asio::local::stream_protocol::acceptor;

  ListenerSettings settings;
  Login login;
  std::optional<boost::asio::ssl::context> tls;
  std::variant<Tcp, Unix> acceptor;
  boost::asio::steady_timer retry;

  /// Binds and listens. Throws std::runtime_error.
  Listener(const ListenerSettings& the_settings, boost::asio::io_context& io);
  std::uint16_t port() const;  ///< 0: a Unix socket
};

struct WebServer::State {
  const WebSettings settings;
  const WebHandlers handlers;
  EncoderDemand& demand;
  Metrics& metrics;
  boost::asio::io_context io{1};  // first: the members below hold its sockets and timers
  std::list<Listener> listeners;
  boost::asio::steady_timer state_timer{io}, stop_timer{io}, network_timer{io};
  bool state_waits = false;
  std::list<std::shared_ptr<Connection>> connections;           ///< oldest first
  std::array<std::shared_ptr<const StreamMessage>, 2> configs;  ///< the newest of each size; may be null
  /// Of recent frames, by sequence number.
  std::deque<std::pair<std::uint32_t, std::chrono::steady_clock::time_point>> capture_times;
  bool uploading = false;  ///< or removing: one at a time
  std::thread thread;
  std::atomic<std::chrono::steady_clock::time_point> last_turn{std::chrono::steady_clock::now()};
  /// Last: what they run uses the members above.
  boost::asio::thread_pool file_thread{1}, snapshot_thread{1};

  State(const WebSettings& the_settings, WebHandlers the_handlers, EncoderDemand& the_demand, Metrics& the_metrics);

  void accept(Listener& listener);
  void admit(Listener& listener, StreamSocket socket, const std::string& remote);
  void forget(const std::shared_ptr<Connection>& connection);
  void objects_changed();
  /// Runs until it is stopped. What a handler throws has ended its connection; the others go on.
  void run();

  /// A copy, since any call of a viewer may close it and so remove its connection.
  std::vector<std::shared_ptr<Connection>> viewers() const;
  /// Whether a viewer more of this listener leaves the others the places that are reserved for them.
  bool has_place(const Listener& listener) const;
  /// Call after viewers or their codecs changed.
  void count_viewers();
  /// The slowest network of a stream's viewers bounds it.
  void bound_streams();
  /// Now, and again a few times a second: chooses sizes, and bounds the streams.
  void look_at_networks();
  void publish(const std::shared_ptr<const StreamMessage>& message);
  void publish_text(const std::string& kind, const std::string& text);
  /// Called when a viewer has displayed the frame: the time since capture goes to the metrics as capture_to_ack.
  void acknowledged(std::uint32_t sequence);
};

}  // namespace lumigraft::server
