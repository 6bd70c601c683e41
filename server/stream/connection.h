#pragma once
// One connection to the web server: HTTP requests, and after a websocket upgrade a viewer.
#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <memory>
#include <string>

#include "server/stream/protocol.h"
#include "server/stream/web_server.h"

namespace lumigraft::server {

struct Listener;
using StreamSocket = boost::asio::generic::stream_protocol::socket;  ///< of TCP or a Unix socket

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  virtual ~Connection() = default;
  virtual void start() = 0;
  virtual bool is_viewer() const = 0;
  virtual const Listener& listener() const = 0;
  virtual Codec codec() const = 0;
  virtual StreamSize size() const = 0;
  /// Of this viewer's H.264 stream, as its network permits; 0: without bound.
  virtual int bound_kbit_s() const = 0;
  /// Takes the other size where the network asks for it. To be called several times a second.
  virtual void look_at_network() = 0;
  virtual void offer(const std::shared_ptr<const StreamMessage>& message) = 0;
  virtual void offer_text(const std::string& kind, const std::string& text) = 0;
  virtual void close() = 0;
  /// Closes the websocket with a reason, after the current write.
  virtual void leave(boost::beast::websocket::close_code code) = 0;
};

/// Encrypted if the listener is. `remote`: address of the other side, empty for a Unix socket.
std::shared_ptr<Connection> make_connection(WebServer::State& server, Listener& listener, StreamSocket socket,
                                            std::string remote);

}  // namespace lumigraft::server
