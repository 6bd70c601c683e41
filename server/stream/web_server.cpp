#include "server/stream/web_server.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <list>
#include <stdexcept>
#include <thread>
#include <utility>

#include "server/stream/request_guard.h"
#include "server/stream/viewer_queue.h"

namespace lumigraft::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

class Connection;

}  // namespace

struct WebServer::State {
  const WebSettings settings;
  const WebHandlers handlers;
  EncoderDemand& demand;
  Metrics& metrics;
  asio::io_context io{1};  // first: the members below hold its sockets and timers
  tcp::acceptor acceptor{io};
  asio::steady_timer state_timer{io}, accept_timer{io}, stop_timer{io};
  bool state_waits = false, loopback = true;
  std::list<std::shared_ptr<Connection>> connections;                   ///< oldest first
  std::shared_ptr<const StreamMessage> config;                          ///< the newest codec configuration; may be null
  std::deque<std::pair<std::uint32_t, std::int64_t>> capture_times_ns;  ///< of recent frames, by sequence number
  std::thread thread;

  State(const WebSettings& the_settings, WebHandlers the_handlers, EncoderDemand& the_demand, Metrics& the_metrics)
      : settings(the_settings), handlers(std::move(the_handlers)), demand(the_demand), metrics(the_metrics) {}

  void accept();
  void admit(tcp::socket socket);
  void forget(const std::shared_ptr<Connection>& connection);
  void objects_changed();

  /// A copy, since any call of a viewer may close it and so remove its connection.
  std::vector<std::shared_ptr<Connection>> viewers() const;
  /// Call after viewers or their codecs changed.
  void count_viewers();
  void publish(const std::shared_ptr<const StreamMessage>& message);
  void publish_text(const std::string& kind, const std::string& text);
  /// Called when a viewer has displayed the frame: the time since capture goes to the metrics as capture_to_ack.
  void acknowledged(std::uint32_t sequence);
};

namespace {

/// One connection: HTTP requests, and after a websocket upgrade a viewer.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(WebServer::State& server, tcp::socket socket)
      : server_(server), stream_(std::move(socket)), write_timer_(server.io) {}

  void read_request() {
    parser_.emplace();
    parser_->header_limit(kStream.max_header_bytes);
    parser_->body_limit(kStream.max_body_bytes);
    stream_.expires_after(server_.settings.request_timeout);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      error ? self->close() : self->answer();
    });
  }

  bool is_viewer() const { return websocket_.has_value(); }
  Codec codec() const { return queue_.codec(); }

  void offer(const std::shared_ptr<const StreamMessage>& message) {
    if (queue_.offer(message)) server_.metrics.drop("viewer");
    write_next();
  }

  void offer_text(const std::string& kind, const std::string& text) {
    queue_.offer_text(kind, text);
    write_next();
  }

  void close() {
    if (closed_) return;
    closed_ = true;
    write_timer_.cancel();
    error_code ignored;
    socket().shutdown(tcp::socket::shutdown_both, ignored);
    socket().close(ignored);
    server_.forget(shared_from_this());
  }

  /// Closes the websocket with a reason, after the current write.
  void leave(websocket::close_code code) {
    if (closed_ || !open_ || leaving_) return;
    leaving_ = code;
    write_next();
  }

 private:
  tcp::socket& socket() { return websocket_ ? beast::get_lowest_layer(*websocket_).socket() : stream_.socket(); }

  void answer() {
    const auto& request = parser_->get();
    const bool upgrade = websocket::is_upgrade(request) && request.target() == "/ws";
    const auto text = [](beast::string_view v) { return std::string_view(v.data(), v.size()); };
    if (!request_allowed(text(request[http::field::host]), text(request[http::field::origin]), server_.loopback)) {
      return reply({403, "text/plain; charset=utf-8", "this host or origin is not served here\n"}, false);
    }
    std::string_view path = text(request.target());
    path = path.substr(0, path.find('?'));
    if (request.method() == http::verb::post && server_.handlers.post) {
      return reply(server_.handlers.post(path), request.keep_alive());
    }
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return reply({405, "text/plain; charset=utf-8", "GET or HEAD\n"}, false);
    }
    if (upgrade) {
      if (static_cast<int>(server_.viewers().size()) >= server_.settings.max_viewers) {
        server_.metrics.refused_connection();
        return reply({503, "text/plain; charset=utf-8", "enough viewers\n"}, false);
      }
      return become_viewer();
    }
    reply(path == "/ws" ? WebReply{426, "text/plain; charset=utf-8", "a websocket\n"} : server_.handlers.get(path),
          request.keep_alive());
  }

  void reply(WebReply content, bool keep_alive) {
    auto response = std::make_shared<http::response<http::string_body>>();
    response->result(content.status);
    response->version(parser_->get().version());
    response->keep_alive(keep_alive);
    response->set(http::field::content_type, content.type);
    response->set(http::field::cache_control, "no-store");
    response->set("X-Content-Type-Options", "nosniff");
    response->set("Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:");
    response->content_length(content.body.size());
    if (parser_->get().method() != http::verb::head) response->body() = std::move(content.body);
    stream_.expires_after(server_.settings.write_timeout);
    http::async_write(stream_, *response,
                      [self = shared_from_this(), response, keep_alive](error_code error, std::size_t) {
                        error || !keep_alive ? self->close() : self->read_request();
                      });
  }

  void become_viewer() {
    stream_.expires_never();
    websocket_.emplace(std::move(stream_));
    server_.count_viewers();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = server_.settings.request_timeout;
    timeout.idle_timeout = server_.settings.silence_timeout;
    timeout.keep_alive_pings = true;
    websocket_->set_option(timeout);
    websocket_->read_message_max(server_.settings.max_message_bytes);
    websocket_->auto_fragment(false);  // one websocket frame per video frame
    error_code ignored;
    socket().set_option(tcp::no_delay(true), ignored);
    socket().set_option(asio::socket_base::send_buffer_size(kStream.send_buffer_bytes), ignored);
    websocket_->async_accept(parser_->get(), [self = shared_from_this()](error_code error) {
      if (error) return self->close();
      self->open_ = true;
      self->buffer_.consume(self->buffer_.size());
      self->queue_.offer_text("hello", self->server_.handlers.hello());
      if (self->server_.config) self->queue_.offer(self->server_.config);
      self->write_next();
      self->read_message();
    });
  }

  void read_message() {
    websocket_->async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) {
        if (error == websocket::error::message_too_big) self->server_.metrics.refused_connection();
        return self->close();
      }
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->obey(self->websocket_->got_text() ? parse_command(text) : BadCommand{"messages are JSON text"});
      if (!self->leaving_) self->read_message();
    });
  }

  void obey(const Command& command) {
    std::optional<std::string> wrong;
    bool harmless = false;
    if (const auto* want = std::get_if<WantCommand>(&command)) {
      queue_.want(want->codec);
      server_.count_viewers();
      server_.demand.key = server_.demand.key || want->codec == Codec::h264;
    } else if (std::holds_alternative<KeyCommand>(command)) {
      server_.demand.key = true;
    } else if (const auto* ack = std::get_if<AckCommand>(&command)) {
      if (queue_.acknowledge(ack->sequence)) server_.acknowledged(ack->sequence);
      write_next();
    } else if (const auto* object = std::get_if<ObjectCommand>(&command)) {
      wrong = server_.handlers.change_object(*object);
      if (!wrong) server_.objects_changed();
      harmless = object->on_pixel.has_value();  // there may be no surface
    } else if (const auto* record = std::get_if<RecordCommandOfViewer>(&command)) {
      wrong = server_.handlers.record(record->on);
    } else if (const auto* playback = std::get_if<PlaybackCommand>(&command)) {
      wrong = server_.handlers.playback(*playback);
    } else {
      wrong = std::get<BadCommand>(command).error;
    }
    if (wrong) {
      queue_.offer_text("error", error_message(*wrong));
      if (!harmless && ++bad_messages_ > 1) return leave(websocket::close_code::policy_error);
      write_next();
    }
  }

  void write_next() {
    if (closed_ || !open_ || writing_) return;
    std::optional<ViewerQueue::Outgoing> next = leaving_ ? queue_.next_text() : queue_.next();
    if (!next) {
      if (leaving_) send_close();
      return;
    }
    writing_ = std::move(*next);
    watch_write();
    const auto* text = std::get_if<std::string>(&*writing_);
    websocket_->text(text != nullptr);
    const asio::const_buffer bytes =
        text != nullptr ? asio::buffer(*text)
                        : asio::buffer(std::get<std::shared_ptr<const StreamMessage>>(*writing_)->bytes);
    websocket_->async_write(bytes, [self = shared_from_this()](error_code error, std::size_t) {
      self->writing_.reset();
      self->write_timer_.cancel();
      error ? self->close() : self->write_next();
    });
  }

  void send_close() {
    if (std::exchange(close_sent_, true)) return;
    watch_write();
    websocket_->async_close(*leaving_, [self = shared_from_this()](error_code) { self->close(); });
  }

  /// Closes the connection when a write exceeds its time limit: the client does not read.
  void watch_write() {
    write_timer_.expires_after(server_.settings.write_timeout);
    write_timer_.async_wait([self = shared_from_this()](error_code error) {
      if (!error && !self->closed_) {
        self->server_.metrics.refused_connection();
        self->close();
      }
    });
  }

  WebServer::State& server_;
  beast::tcp_stream stream_;
  std::optional<websocket::stream<beast::tcp_stream>> websocket_;
  beast::flat_buffer buffer_{kStream.max_header_bytes + 64 * 1024};
  std::optional<http::request_parser<http::string_body>> parser_;
  ViewerQueue queue_;
  std::optional<ViewerQueue::Outgoing> writing_;
  asio::steady_timer write_timer_;
  std::optional<websocket::close_code> leaving_;
  int bad_messages_ = 0;
  bool open_ = false, closed_ = false, close_sent_ = false;
};

}  // namespace

void WebServer::State::accept() {
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {  // no file descriptors left: retry later
      accept_timer.expires_after(std::chrono::milliseconds(100));
      accept_timer.async_wait([this](error_code stopped) {
        if (!stopped) accept();
      });
      return;
    }
    admit(std::move(socket));
    accept();
  });
}

void WebServer::State::admit(tcp::socket socket) {
  const auto full = [&] { return static_cast<int>(connections.size()) >= settings.max_connections; };
  const auto oldest =
      std::find_if(connections.begin(), connections.end(), [](const auto& other) { return !other->is_viewer(); });
  if (full() && oldest != connections.end()) {
    metrics.refused_connection();
    (*oldest)->close();
  }
  if (full()) {
    metrics.refused_connection();
    return;
  }
  connections.push_back(std::make_shared<Connection>(*this, std::move(socket)));
  connections.back()->read_request();
}

void WebServer::State::forget(const std::shared_ptr<Connection>& connection) {
  connections.remove(std::shared_ptr(connection));  // a copy: the argument must not refer into the list
  count_viewers();
}

void WebServer::State::objects_changed() {
  if (std::exchange(state_waits, true)) return;
  state_timer.expires_after(kStream.states_apart);
  state_timer.async_wait([this](error_code error) {
    state_waits = false;
    if (!error) publish_text("state", handlers.state());
  });
}

std::vector<std::shared_ptr<Connection>> WebServer::State::viewers() const {
  std::vector<std::shared_ptr<Connection>> all;
  std::ranges::copy_if(connections, std::back_inserter(all), [](const auto& one) { return one->is_viewer(); });
  return all;
}

void WebServer::State::count_viewers() {
  const std::vector<std::shared_ptr<Connection>> all = viewers();
  metrics.viewers(static_cast<int>(all.size()));
  demand.h264 = static_cast<int>(std::ranges::count(all, Codec::h264, &Connection::codec));
  demand.jpeg = static_cast<int>(std::ranges::count(all, Codec::jpeg, &Connection::codec));
}

void WebServer::State::publish(const std::shared_ptr<const StreamMessage>& message) {
  if (message->header.kind == StreamKind::config) {
    config = message;
  } else {
    capture_times_ns.emplace_back(message->header.sequence, message->header.capture_time_ns);
    if (capture_times_ns.size() > kStream.remembered_frames) capture_times_ns.pop_front();
  }
  for (const auto& viewer : viewers()) viewer->offer(message);
}

void WebServer::State::publish_text(const std::string& kind, const std::string& text) {
  for (const auto& viewer : viewers()) viewer->offer_text(kind, text);
}

void WebServer::State::acknowledged(std::uint32_t sequence) {
  const auto known = std::ranges::find(capture_times_ns, sequence, [](const auto& frame) { return frame.first; });
  if (known == capture_times_ns.end()) return;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  metrics.time("capture_to_ack", 1e-9 * static_cast<double>(now_ns - known->second));
}

WebServer::WebServer(const WebSettings& settings, WebHandlers handlers, EncoderDemand& demand, Metrics& metrics)
    : state_(std::make_unique<State>(settings, std::move(handlers), demand, metrics)) {
  State& s = *state_;
  try {
    const tcp::endpoint endpoint(asio::ip::make_address(settings.address), settings.port);
    s.loopback = endpoint.address().is_loopback();
    s.acceptor.open(endpoint.protocol());
    s.acceptor.set_option(asio::socket_base::reuse_address(true));
    s.acceptor.bind(endpoint);
    s.acceptor.listen(1024);
  } catch (const boost::system::system_error& e) {
    throw std::runtime_error("cannot listen on " + settings.address + " port " + std::to_string(settings.port) + ": " +
                             e.code().message());
  }
}

WebServer::~WebServer() { stop(); }

std::uint16_t WebServer::port() const { return state_->acceptor.local_endpoint().port(); }

void WebServer::start() {
  state_->accept();
  state_->thread = std::thread([this] { state_->io.run(); });
}

void WebServer::publish(std::shared_ptr<const StreamMessage> message) {
  asio::post(state_->io, [&s = *state_, message = std::move(message)] { s.publish(message); });
}

void WebServer::publish_text(const std::string& kind, std::string text) {
  asio::post(state_->io, [&s = *state_, kind, text = std::move(text)] { s.publish_text(kind, text); });
}

void WebServer::stop() {
  State& s = *state_;
  if (!s.thread.joinable()) return;
  asio::post(s.io, [&s] {
    error_code ignored;
    s.acceptor.close(ignored);
    for (const auto& viewer : s.viewers()) viewer->leave(websocket::close_code::going_away);
    s.stop_timer.expires_after(s.viewers().empty() ? std::chrono::milliseconds(0) : kStream.goodbye);
    s.stop_timer.async_wait([&s](error_code) { s.io.stop(); });
  });
  s.thread.join();
}

}  // namespace lumigraft::server
