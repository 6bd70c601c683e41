#include "server/stream/connection.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <charconv>
#include <chrono>
#include <limits>
#include <type_traits>
#include <utility>

#include "server/stream/network_rate.h"
#include "server/stream/parameters.h"
#include "server/stream/request_guard.h"
#include "server/stream/size_choice.h"
#include "server/stream/token_bucket.h"
#include "server/stream/upload.h"
#include "server/stream/viewer_queue.h"
#include "server/stream/web_server_state.h"

namespace lumigraft::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using PlainStream = beast::basic_stream<asio::generic::stream_protocol>;
using TlsStream = beast::ssl_stream<PlainStream>;

constexpr std::uint32_t kGreeting = 0xffffffff;  ///< in place of a picture's number, of a ping that is alone
constexpr const char* kPlainText = "text/plain; charset=utf-8";

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Little waits in the kernel's buffer. BBR, where the kernel has it: of random loss, as on wireless links, CUBIC
/// concludes that the network is full. Both may fail, as for a Unix socket.
void for_far_viewers(int socket) {
  ::setsockopt(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kStream.unsent_bytes, sizeof(kStream.unsent_bytes));
  constexpr std::string_view kBbr = "bbr";
  ::setsockopt(socket, IPPROTO_TCP, TCP_CONGESTION, kBbr.data(), kBbr.size());
}

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

template <typename Stream>
class StreamConnection final : public Connection {
 public:
  StreamConnection(WebServer::State& server, Listener& listener, Stream stream, std::string remote)
      : server_(server),
        listener_(listener),
        remote_(std::move(remote)),
        stream_(std::move(stream)),
        write_timer_(server.io) {}

  void start() override {
    if constexpr (kEncrypted) {
      lowest().expires_after(server_.settings.request_timeout);
      stream_->async_handshake(asio::ssl::stream_base::server,
                               [self = self()](error_code error) { error ? self->close() : self->read_request(); });
    } else {
      read_request();
    }
  }

  bool is_viewer() const override { return websocket_.has_value(); }
  const Listener& listener() const override { return listener_; }
  Codec codec() const override { return queue_.codec(); }
  StreamSize size() const override { return queue_.size(); }
  int bound_kbit_s() const override { return network_.bound_kbit_s(); }

  void look_at_network() override {
    const auto now = std::chrono::steady_clock::now();
    queue_.network_trip(network_.shortest_trip());
    if (queue_.codec() == Codec::h264) {
      const StreamSize size = size_.choose(network_.below_limits(), now);
      if (size != queue_.size()) want(Codec::h264, size);
    }
    write_next();  // what was under way may count as lost now
  }

  void offer(const std::shared_ptr<const StreamMessage>& message) override {
    const auto now = std::chrono::steady_clock::now();
    if (queue_.offer(message, now)) server_.metrics.drop("viewer");
    write_next();
  }

  void offer_text(const std::string& kind, const std::string& text) override {
    queue_.offer_text(kind, text);
    write_next();
  }

  void close() override {
    if (closed_) return;
    closed_ = true;
    write_timer_.cancel();
    tell_encoder();
    error_code ignored;
    lowest().socket().shutdown(asio::socket_base::shutdown_both, ignored);
    lowest().socket().close(ignored);
    server_.forget(shared_from_this());
  }

  void leave(websocket::close_code code) override {
    if (closed_ || !open_ || leaving_) return;
    leaving_ = code;
    write_next();
  }

 private:
  static constexpr bool kEncrypted = std::is_same_v<Stream, TlsStream>;

  std::shared_ptr<StreamConnection> self() { return std::static_pointer_cast<StreamConnection>(shared_from_this()); }
  PlainStream& lowest() {
    return websocket_ ? beast::get_lowest_layer(*websocket_) : beast::get_lowest_layer(*stream_);
  }

  void read_request() {
    header_.emplace();
    header_->header_limit(kStream.max_header_bytes);
    header_->body_limit(std::numeric_limits<std::uint64_t>::max());  // of a body that is not read with it
    lowest().expires_after(server_.settings.request_timeout);
    http::async_read_header(*stream_, buffer_, *header_, [self = self()](error_code error, std::size_t) {
      if (error) return self->close();
      self->parser_.emplace();  // replies refer to it
      self->parser_->get().base() = self->header_->get().base();
      try {
        if (self->header_->get().method() == http::verb::put) return self->receive_upload();
        self->read_body();
      } catch (const std::exception&) {
        self->reply({.status = 500, .type = kPlainText, .body = "the service failed to answer\n"}, false);
      }
    });
  }

  void read_body() {
    if (header_->content_length().value_or(0) > kStream.max_body_bytes)
      return reply({.status = 413, .type = kPlainText, .body = "too long a body\n"}, false);
    parser_.emplace(std::move(*header_));
    parser_->body_limit(kStream.max_body_bytes);
    http::async_read(*stream_, buffer_, *parser_, [self = self()](error_code error, std::size_t) {
      if (error) return self->close();
      try {
        self->answer();
      } catch (const std::exception&) {
        self->reply({.status = 500, .type = kPlainText, .body = "the service failed to answer\n"}, false);
      }
    });
  }

  /// Of a viewer: what fails here closes its connection and no other.
  template <typename Act>
  void guarded(const Act& act) {
    try {
      act();
    } catch (const std::exception&) {
      server_.metrics.refused_connection();
      close();
    }
  }

  /// Answers with what `make` returns on that thread, or with `failed` if it throws; before that, `made` runs on this
  /// one. Meanwhile the others go on, and this connection reads nothing.
  template <typename Make, typename Made>
  void answer_from(asio::thread_pool& thread, bool keep_alive, const char* failed, Make make, Made made) {
    lowest().expires_never();
    asio::post(thread, [self = self(), keep_alive, failed, make = std::move(make), made]() mutable {
      WebReply answer{.status = 500, .type = kPlainText, .body = failed};
      try {
        answer = make();
      } catch (const std::exception&) {
      }
      asio::post(self->server_.io, [self, keep_alive, made, answer = std::move(answer)]() mutable {
        made();
        self->reply(std::move(answer), keep_alive);
      });
    });
  }
  /// Who has the answer may send the next model.
  template <typename Make>
  void answer_upload(const char* failed, Make make) {
    answer_from(server_.file_thread, false, failed, std::move(make), [&server = server_] { server.uploading = false; });
  }

  static constexpr std::string_view kModels = "/models/";

  /// DELETE /models/NAME.
  void remove_model(std::string_view path) {
    const auto refuse = [&](unsigned status, const char* body) {
      reply({.status = status, .type = kPlainText, .body = body}, false);
    };
    if (!server_.handlers.upload || !path.starts_with(kModels)) return refuse(405, "GET or HEAD\n");
    if (!listener_.settings.permissions.has(Permission::admin)) return refuse(403, "not permitted on this listener\n");
    if (server_.uploading) return refuse(409, "found an upload that is not finished, allowed: one at a time\n");
    server_.uploading = true;
    answer_upload("the service failed to remove the model\n", [this, name = std::string(path.substr(kModels.size()))] {
      return server_.handlers.upload->remove(name);
    });
  }

  /// PUT /models/NAME.
  void receive_upload() {
    const auto& request = header_->get();
    const auto field = [&](http::field name) { return view_of(request[name]); };
    const auto refuse = [&](unsigned status, const char* body) {
      reply({.status = status, .type = kPlainText, .body = body}, false);
    };
    const std::string path(view_of(request.target()));
    if (!request_allowed(field(http::field::host), field(http::field::origin), listener_.settings))
      return refuse(403, "this host or origin is not served here\n");
    if (listener_.login.required() && answer_login(path)) return;
    if (!server_.handlers.upload || !path.starts_with(kModels)) return refuse(405, "GET or HEAD\n");
    if (!listener_.settings.permissions.has(Permission::admin)) return refuse(403, "not permitted on this listener\n");
    if (server_.uploading) return refuse(409, "found another upload that is not finished, allowed: one at a time\n");
    const std::string name = path.substr(kModels.size());
    const auto length = header_->content_length();
    auto place = server_.handlers.upload->begin(name, length ? std::optional<std::uint64_t>(*length) : std::nullopt);
    if (auto* why_not = std::get_if<WebReply>(&place)) return reply(std::move(*why_not), false);
    const auto& to = std::get<UploadHandlers::Place>(place);
    server_.uploading = true;
    const auto upload =
        std::make_shared<Upload<Stream>>(std::move(*header_), to.file, to.max_bytes, server_.settings.request_timeout,
                                         *stream_, buffer_, server_.io, server_.file_thread);
    upload->start([self = self(), upload = upload.get(), name](UploadEnd end) {
      if (end == UploadEnd::received) return self->take_upload(upload->shared_from_this(), name);
      self->server_.uploading = false;
      if (end == UploadEnd::disconnected) return self->close();
      self->reply({.status = 507, .type = kPlainText, .body = "the model cannot be written: the disk takes no more\n"},
                  false);
    });
  }

  void take_upload(std::shared_ptr<Upload<Stream>> upload, const std::string& name) {
    answer_upload("the service failed to take the model\n", [this, upload = std::move(upload), name]() mutable {
      const auto removed_at_the_end = std::move(upload);
      return server_.handlers.upload->received(removed_at_the_end->file(), name);
    });
  }

  void answer() {
    const auto& request = parser_->get();
    const auto field = [&](http::field name) { return view_of(request[name]); };
    if (!request_allowed(field(http::field::host), field(http::field::origin), listener_.settings)) {
      return reply({.status = 403, .type = kPlainText, .body = "this host or origin is not served here\n"}, false);
    }
    std::string_view path = view_of(request.target());
    path = path.substr(0, path.find('?'));
    if (listener_.login.required() && answer_login(path)) return;
    if (request.method() == http::verb::post && server_.handlers.post) {
      return reply(server_.handlers.post(path), request.keep_alive());
    }
    if (request.method() == http::verb::delete_) return remove_model(path);
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return reply({.status = 405, .type = kPlainText, .body = "GET or HEAD\n"}, false);
    }
    if (!listener_.settings.permissions.has(needed(path))) {
      return reply({.status = 403, .type = kPlainText, .body = "not permitted on this listener\n"},
                   request.keep_alive());
    }
    if (path == "/ws" && websocket::is_upgrade(request)) {
      if (!server_.has_place(listener_)) {
        server_.metrics.refused_connection();
        return reply({.status = 503, .type = kPlainText, .body = "enough viewers\n"}, false);
      }
      return become_viewer();
    }
    if (path == "/snapshot.jpg" && server_.handlers.snapshot)
      return answer_from(
          server_.snapshot_thread, request.keep_alive(), "the service failed to answer\n",
          [&server = server_] { return server.handlers.snapshot(); }, [] {});
    reply(path == "/ws" ? WebReply{.status = 426, .type = kPlainText, .body = "a websocket\n"}
                        : server_.handlers.get(path),
          request.keep_alive());
  }

  static Permission needed(std::string_view path) { return path == "/metrics" ? Permission::admin : Permission::view; }

  /// Of a listener with a token: true if the request was answered here, as it is not authorized or concerns the login.
  bool answer_login(std::string_view path) {
    const auto& request = parser_->get();
    // What a watchdog or the form itself needs says nothing.
    if (path == "/healthz" || path == "/style.css" || path == "/text.js" || path == "/texts.js") return false;
    if (path == "/login" && request.method() == http::verb::post) {
      std::string cookie;
      switch (listener_.login.log_in(request.body(), remote_, now_s(), cookie)) {
        case Login::Answer::accepted: {
          WebReply in{.status = 303, .type = kPlainText, .body = ""};
          in.headers.emplace_back("Location", "/");
          in.headers.emplace_back("Set-Cookie", std::string(Login::kCookie) + '=' + cookie +
                                                    "; HttpOnly; SameSite=Strict; Path=/" +
                                                    (kEncrypted ? "; Secure" : ""));
          reply(std::move(in), request.keep_alive());
          break;
        }
        case Login::Answer::wrong:
          server_.metrics.refused_connection();
          reply(redirect("/login?wrong"), request.keep_alive());
          break;
        case Login::Answer::too_many_attempts:
          server_.metrics.refused_connection();
          reply(too_many_attempts(), false);
          break;
      }
      return true;
    }
    const auto field = [&](http::field name) { return view_of(request[name]); };
    if (listener_.login.authorized(field(http::field::authorization), field(http::field::cookie), remote_, now_s()))
      return false;
    const bool reads = request.method() == http::verb::get || request.method() == http::verb::head;
    if (path == "/login" && reads) {
      reply(view_of(request.target()).starts_with("/login?wrong") ? login_page("login-wrong") : login_page(),
            request.keep_alive());
    } else if (path == "/" && reads) {
      reply(redirect("/login"), request.keep_alive());
    } else {
      WebReply unknown{.status = 401, .type = kPlainText, .body = "log in at /login, or send the token\n"};
      unknown.headers.emplace_back("WWW-Authenticate", "Bearer");
      reply(std::move(unknown), false);
    }
    return true;
  }

  /// The form, with the one of its messages that has this id.
  WebReply login_page(const std::string& message = "") const {
    WebReply page = server_.handlers.get("/login.html");
    const std::string shown = "id=\"" + message + '"', hidden = shown + " hidden";
    if (const std::size_t at = page.body.find(hidden); at != std::string::npos)
      page.body.replace(at, hidden.size(), shown);
    return page;
  }

  WebReply too_many_attempts() const {
    WebReply page = login_page("login-wait");
    page.status = 429;
    page.headers.emplace_back("Retry-After", std::to_string(static_cast<int>(kStream.attempts_within_s)));
    return page;
  }

  static WebReply redirect(const char* to) {
    WebReply elsewhere{.status = 303, .type = kPlainText, .body = ""};
    elsewhere.headers.emplace_back("Location", to);
    return elsewhere;
  }

  void reply(WebReply content, bool keep_alive) {
    auto response = std::make_shared<http::response<http::string_body>>();
    response->result(content.status);
    response->version(parser_->get().version());
    response->keep_alive(keep_alive);
    response->set(http::field::content_type, content.type);
    response->set(http::field::cache_control, "no-store");
    response->set("X-Content-Type-Options", "nosniff");
    std::string ancestors = "'self'";
    for (const std::string& origin : listener_.settings.allowed_origins) ancestors += ' ' + origin;
    response->set("Content-Security-Policy",
                  "default-src 'self'; img-src 'self' blob: data:; " +
                      (content.connects_to.empty() ? "" : "connect-src 'self' " + content.connects_to + "; ") +
                      "frame-ancestors " + ancestors);
    for (const auto& [name, value] : content.headers) response->set(name, value);
    response->content_length(content.body.size());
    if (parser_->get().method() != http::verb::head) response->body() = std::move(content.body);
    lowest().expires_after(server_.settings.write_timeout);
    http::async_write(*stream_, *response, [self = self(), response, keep_alive](error_code error, std::size_t) {
      error || !keep_alive ? self->close() : self->read_request();
    });
  }

  void become_viewer() {
    lowest().expires_never();
    websocket_.emplace(std::move(*stream_));
    server_.count_viewers();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = server_.settings.request_timeout;
    timeout.idle_timeout = server_.settings.silence_timeout;
    timeout.keep_alive_pings = true;
    websocket_->set_option(timeout);
    websocket_->read_message_max(server_.settings.max_message_bytes);
    websocket_->auto_fragment(false);  // one websocket frame per video frame
    error_code ignored;
    lowest().socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    lowest().socket().set_option(asio::socket_base::send_buffer_size(kStream.send_buffer_bytes), ignored);
    for_far_viewers(lowest().socket().native_handle());
    websocket_->control_callback([this](websocket::frame_type kind, beast::string_view payload) {
      if (kind == websocket::frame_type::pong) confirmed(view_of(payload));
    });
    websocket_->async_accept(parser_->get(), [self = self()](error_code error) {
      if (error) return self->close();
      self->guarded([&] {
        self->open_ = true;
        self->buffer_.consume(self->buffer_.size());
        self->queue_.offer_text("hello", self->server_.handlers.hello(self->listener_.settings.permissions));
        self->network_.sent(kGreeting, 0, std::chrono::steady_clock::now());
        self->ping(kGreeting);
        self->write_next();
        self->read_message();
      });
    });
  }

  void read_message() {
    websocket_->async_read(buffer_, [self = self()](error_code error, std::size_t) {
      if (error) {
        if (error == websocket::error::message_too_big) self->server_.metrics.refused_connection();
        return self->close();
      }
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->guarded([&] {
        self->obey(self->websocket_->got_text() ? parse_command(text) : BadCommand{"messages are JSON text"});
      });
      if (!self->leaving_ && !self->closed_) self->read_message();
    });
  }

  /// The permission that a command needs beyond view; none for those of the stream itself.
  static std::optional<Permission> needed(const Command& command) {
    if (std::holds_alternative<ObjectCommand>(command) || std::holds_alternative<PlaybackCommand>(command))
      return Permission::control;
    if (std::holds_alternative<RecordCommandOfViewer>(command)) return Permission::record;
    if (std::holds_alternative<SaveCommand>(command)) return Permission::admin;
    return std::nullopt;
  }

  void obey(const Command& command) {
    std::optional<std::string> wrong;
    bool harmless = false;
    const std::optional<Permission> permission = needed(command);
    if (permission && !listener_.settings.permissions.has(*permission)) {
      wrong = "found a command that this listener does not permit, allowed: what `permissions` of hello says";
      harmless = true;
    } else if (permission && !commands_.take(now_s())) {
      wrong =
          "found too many commands, allowed: " + std::to_string(static_cast<int>(kStream.commands_per_s)) + " a second";
      harmless = true;
    } else if (const auto* want = std::get_if<WantCommand>(&command)) {
      size_.ask(want->size);
      this->want(want->codec, want->size.value_or(StreamSize::full));
    } else if (std::holds_alternative<KeyCommand>(command)) {
      server_.demand.of(queue_.size()).key = true;
    } else if (const auto* ack = std::get_if<AckCommand>(&command)) {
      if (queue_.acknowledge(ack->sequence, std::chrono::steady_clock::now())) server_.acknowledged(ack->sequence);
      write_next();
    } else if (const auto* object = std::get_if<ObjectCommand>(&command)) {
      wrong = server_.handlers.change_object(*object);
      if (!wrong) server_.objects_changed();
      harmless = true;  // there may be no surface, or the object has just gone
    } else if (const auto* record = std::get_if<RecordCommandOfViewer>(&command)) {
      wrong = server_.handlers.record(record->on);
    } else if (const auto* playback = std::get_if<PlaybackCommand>(&command)) {
      wrong = server_.handlers.playback(*playback);
    } else if (std::holds_alternative<SaveCommand>(command)) {
      queue_.offer_text("saved", saved_message(server_.handlers.save()));
      server_.objects_changed();
      write_next();
    } else {
      wrong = std::get<BadCommand>(command).error;
    }
    if (wrong) {
      queue_.offer_text("error", error_message(*wrong));
      if (!harmless && ++bad_messages_ > 1) return leave(websocket::close_code::policy_error);
      write_next();
    }
  }

  void want(Codec codec, StreamSize size) {
    queue_.want(codec, size);
    RateLimits limits = server_.settings.rate;
    if (size == StreamSize::half) limits.min_kbit_s /= 4;  // a quarter of the pixels
    network_.restart(limits);
    if (const auto& config = server_.configs[static_cast<std::size_t>(size)])
      queue_.offer(config, std::chrono::steady_clock::now());
    server_.count_viewers();
    write_next();
  }

  /// Whether this viewer can be sent a picture of its H.264 stream now, and needs a key frame for it.
  void tell_encoder() {
    const auto now = std::chrono::steady_clock::now();
    const bool watches = !closed_ && open_ && queue_.codec() == Codec::h264;
    const bool busy = watches && (writing_ || !queue_.ready(now));
    if (busy_in_ != (busy ? std::optional(queue_.size()) : std::nullopt)) {
      if (busy_in_) --server_.demand.of(*busy_in_).h264_busy;
      busy_in_ = busy ? std::optional(queue_.size()) : std::nullopt;
      if (busy_in_) ++server_.demand.of(*busy_in_).h264_busy;
    }
    if (watches && !writing_ && queue_.wants_key(now)) server_.demand.of(queue_.size()).key = true;
  }

  /// The pong of a ping that followed these pictures. A client that sends pongs of its own confirms nothing.
  void confirmed(std::string_view payload) {
    std::uint32_t sequence = 0;
    const auto [end, error] = std::from_chars(payload.data(), payload.data() + payload.size(), sequence);
    if (error != std::errc() || end != payload.data() + payload.size()) return;
    const int bound_before = network_.bound_kbit_s();
    network_.confirmed(sequence, std::chrono::steady_clock::now());
    // At once: the next picture may be a key frame, which without a bound is under way for seconds.
    if (bound_before == 0 && network_.bound_kbit_s() > 0) server_.bound_streams();
  }

  /// A ping right behind a picture: its pong says when the network had delivered that, through proxies too.
  void ping(std::uint32_t sequence) {
    if (std::exchange(pinging_, true)) return;
    websocket_->async_ping(websocket::ping_data(std::to_string(sequence)), [self = self()](error_code error) {
      self->pinging_ = false;
      if (error) self->close();
    });
  }

  void write_next() {
    write_one();
    tell_encoder();
  }

  void write_one() {
    if (closed_ || !open_ || writing_) return;
    std::optional<ViewerQueue::Outgoing> next =
        leaving_ ? queue_.next_text() : queue_.next(std::chrono::steady_clock::now());
    if (!next) {
      if (leaving_) send_close();
      return;
    }
    writing_ = std::move(*next);
    watch_write();
    const auto* text = std::get_if<std::string>(&*writing_);
    websocket_->text(text != nullptr);
    const StreamMessage* message =
        text != nullptr ? nullptr : std::get<std::shared_ptr<const StreamMessage>>(*writing_).get();
    const bool picture = message != nullptr && message->header.kind != StreamKind::config;
    if (picture) network_.sent(message->header.sequence, message->bytes.size(), std::chrono::steady_clock::now());
    const std::optional<std::uint32_t> sequence = picture ? std::optional(message->header.sequence) : std::nullopt;
    websocket_->async_write(text != nullptr ? asio::buffer(*text) : asio::buffer(message->bytes),
                            [self = self(), sequence](error_code error, std::size_t) {
                              self->writing_.reset();
                              self->write_timer_.cancel();
                              if (error) return self->close();
                              if (sequence) self->ping(*sequence);
                              self->write_next();
                            });
  }

  void send_close() {
    if (std::exchange(close_sent_, true)) return;
    watch_write();
    websocket_->async_close(*leaving_, [self = self()](error_code) { self->close(); });
  }

  /// Closes the connection when a write exceeds its time limit: the client does not read.
  void watch_write() {
    write_timer_.expires_after(server_.settings.write_timeout);
    write_timer_.async_wait([self = self()](error_code error) {
      if (!error && !self->closed_) {
        self->server_.metrics.refused_connection();
        self->close();
      }
    });
  }

  WebServer::State& server_;
  Listener& listener_;
  const std::string remote_;
  std::optional<Stream> stream_;  ///< moved into `websocket_` when that begins
  std::optional<websocket::stream<Stream>> websocket_;
  beast::flat_buffer buffer_{kStream.max_header_bytes + 64 * 1024};
  std::optional<http::request_parser<http::empty_body>> header_;
  std::optional<http::request_parser<http::string_body>> parser_;
  ViewerQueue queue_;
  SizeChoice size_;
  NetworkRate network_{server_.settings.rate};
  std::optional<StreamSize> busy_in_;  ///< as the encoder was told
  TokenBucket commands_{kStream.commands_per_s, kStream.max_commands};
  std::optional<ViewerQueue::Outgoing> writing_;
  asio::steady_timer write_timer_;
  std::optional<websocket::close_code> leaving_;
  int bad_messages_ = 0;
  bool open_ = false, closed_ = false, close_sent_ = false, pinging_ = false;
};

}  // namespace

std::shared_ptr<Connection> make_connection(WebServer::State& server, Listener& listener, StreamSocket socket,
                                            std::string remote) {
  PlainStream plain(std::move(socket));
  if (!listener.tls)
    return std::make_shared<StreamConnection<PlainStream>>(server, listener, std::move(plain), std::move(remote));
  return std::make_shared<StreamConnection<TlsStream>>(server, listener, TlsStream(std::move(plain), *listener.tls),
                                                       std::move(remote));
}

}  // namespace lumigraft::server
