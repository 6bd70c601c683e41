#include "server/stream/web_server.h"

#include <pthread.h>
#include <sys/stat.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>

#include "server/stream/parameters.h"
#include "server/stream/web_server_state.h"

namespace lumigraft::server {
namespace {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr int kBacklog = 1024;

asio::ssl::context tls_of(const ListenerSettings& settings) {
  asio::ssl::context tls(asio::ssl::context::tls_server);
  tls.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_sslv3 |
                  asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1);
  const auto read = [](const std::filesystem::path& file, const auto& use) {
    error_code error;
    use(error);
    if (error) throw std::runtime_error(file.string() + ": found " + error.message() + ", allowed: a PEM file");
  };
  read(settings.certificate,
       [&](error_code& error) { tls.use_certificate_chain_file(settings.certificate.string(), error); });
  read(settings.key,
       [&](error_code& error) { tls.use_private_key_file(settings.key.string(), asio::ssl::context::pem, error); });
  return tls;
}

/// A socket that a service which ended without warning has left is replaced, any other file is not.
void remove_old_socket(const std::filesystem::path& path, asio::io_context& io) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode)) throw std::runtime_error("cannot listen on " + path.string() + ": a file is there");
  asio::local::stream_protocol::socket other(io);
  error_code error;
  other.connect(path.string(), error);
  if (!error) throw std::runtime_error("cannot listen on " + path.string() + ": another program does");
  std::filesystem::remove(path);
}

}  // namespace

Listener::Listener(const ListenerSettings& the_settings, asio::io_context& io)
    : settings(the_settings), login(the_settings.token), acceptor(std::in_place_type<Tcp>, io), retry(io) {
  if (settings.encrypted()) tls.emplace(tls_of(settings));
  const auto listen = [](auto& on, const auto& endpoint, bool again) {
    on.open(endpoint.protocol());
    if (again) on.set_option(asio::socket_base::reuse_address(true));
    on.bind(endpoint);
    on.listen(kBacklog);
  };
  try {
    if (settings.socket.empty()) {
      listen(std::get<Tcp>(acceptor), tcp::endpoint(asio::ip::make_address(settings.address), settings.port), true);
    } else {
      remove_old_socket(settings.socket, io);
      acceptor.emplace<Unix>(io);
      listen(std::get<Unix>(acceptor), asio::local::stream_protocol::endpoint(settings.socket.string()), false);
    }
  } catch (const boost::system::system_error& e) {
    throw std::runtime_error("cannot listen on " +
                             (settings.socket.empty() ? settings.address + " port " + std::to_string(settings.port)
                                                      : settings.socket.string()) +
                             ": " + e.code().message());
  }
}

std::uint16_t Listener::port() const {
  return settings.socket.empty() ? std::get<Tcp>(acceptor).local_endpoint().port() : std::uint16_t{0};
}

WebServer::State::State(const WebSettings& the_settings, WebHandlers the_handlers, EncoderDemand& the_demand,
                        Metrics& the_metrics)
    : settings(the_settings), handlers(std::move(the_handlers)), demand(the_demand), metrics(the_metrics) {
  for (const ListenerSettings& listener : settings.listeners) listeners.emplace_back(listener, io);
}

void WebServer::State::accept(Listener& listener) {
  std::visit(
      [&](auto& acceptor) {
        using Socket = typename std::remove_reference_t<decltype(acceptor)>::protocol_type::socket;
        acceptor.async_accept([this, &listener](error_code error, Socket socket) {
          if (error == asio::error::operation_aborted) return;
          if (error) {  // no file descriptors left: retry later
            listener.retry.expires_after(std::chrono::milliseconds(100));
            listener.retry.async_wait([this, &listener](error_code stopped) {
              if (!stopped) accept(listener);
            });
            return;
          }
          std::string remote;
          if constexpr (std::is_same_v<Socket, tcp::socket>) {
            error_code gone;
            remote = socket.remote_endpoint(gone).address().to_string();
          }
          admit(listener, StreamSocket(std::move(socket)), remote);
          accept(listener);
        });
      },
      listener.acceptor);
}

void WebServer::State::admit(Listener& listener, StreamSocket socket, const std::string& remote) {
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
  connections.push_back(make_connection(*this, listener, std::move(socket), remote));
  connections.back()->start();
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

void WebServer::State::run() {
  for (bool again = true; again;) {
    again = false;
    try {
      io.run();
    } catch (const std::exception&) {
      metrics.refused_connection();
      again = true;
    }
  }
}

std::vector<std::shared_ptr<Connection>> WebServer::State::viewers() const {
  std::vector<std::shared_ptr<Connection>> all;
  std::ranges::copy_if(connections, std::back_inserter(all), [](const auto& one) { return one->is_viewer(); });
  return all;
}

bool WebServer::State::has_place(const Listener& listener) const {
  const std::vector<std::shared_ptr<Connection>> all = viewers();
  int free = settings.max_viewers - static_cast<int>(all.size());
  for (const Listener& other : listeners) {
    if (&other == &listener) continue;
    const auto there = std::ranges::count_if(all, [&](const auto& one) { return &one->listener() == &other; });
    free -= std::max(other.settings.reserved_viewers - static_cast<int>(there), 0);
  }
  return free > 0;
}

void WebServer::State::count_viewers() {
  const std::vector<std::shared_ptr<Connection>> all = viewers();
  metrics.viewers(static_cast<int>(all.size()));
  for (const StreamSize size : {StreamSize::full, StreamSize::half}) {
    const auto watching = [&](Codec codec) {
      return static_cast<int>(
          std::ranges::count_if(all, [&](const auto& one) { return one->codec() == codec && one->size() == size; }));
    };
    demand.of(size).h264 = watching(Codec::h264);
    demand.of(size).jpeg = watching(Codec::jpeg);
  }
}

void WebServer::State::bound_streams() {
  for (const StreamSize size : {StreamSize::full, StreamSize::half}) {
    int slowest_kbit_s = 0;
    for (const auto& viewer : viewers()) {
      if (viewer->codec() != Codec::h264 || viewer->size() != size || viewer->bound_kbit_s() == 0) continue;
      slowest_kbit_s = slowest_kbit_s == 0 ? viewer->bound_kbit_s() : std::min(slowest_kbit_s, viewer->bound_kbit_s());
    }
    demand.of(size).rate_kbit_s = slowest_kbit_s;
  }
}

void WebServer::State::look_at_networks() {
  for (const auto& viewer : viewers()) viewer->look_at_network();
  bound_streams();
  network_timer.expires_after(kStream.networks_apart);
  network_timer.async_wait([this](error_code error) {
    if (!error) look_at_networks();
  });
}

void WebServer::State::publish(const std::shared_ptr<const StreamMessage>& message) {
  if (message->header.kind == StreamKind::config) {
    configs[static_cast<std::size_t>(message->size)] = message;
  } else if (capture_times.empty() || capture_times.back().first != message->header.sequence) {
    capture_times.emplace_back(message->header.sequence, message->captured);
    if (capture_times.size() > kStream.remembered_frames) capture_times.pop_front();
  }
  for (const auto& viewer : viewers()) viewer->offer(message);
}

void WebServer::State::publish_text(const std::string& kind, const std::string& text) {
  for (const auto& viewer : viewers()) viewer->offer_text(kind, text);
}

void WebServer::State::acknowledged(std::uint32_t sequence) {
  const auto known = std::ranges::find(capture_times, sequence, [](const auto& frame) { return frame.first; });
  if (known == capture_times.end()) return;
  const auto age = std::chrono::steady_clock::now() - known->second;
  metrics.time("capture_to_ack", std::chrono::duration<double>(age).count());
}

WebServer::WebServer(const WebSettings& settings, WebHandlers handlers, EncoderDemand& demand, Metrics& metrics)
    : state_(std::make_unique<State>(settings, std::move(handlers), demand, metrics)) {}

WebServer::~WebServer() { stop(); }

std::uint16_t WebServer::port(std::size_t listener) const {
  return std::next(state_->listeners.begin(), static_cast<std::ptrdiff_t>(listener))->port();
}

void WebServer::start() {
  for (Listener& listener : state_->listeners) state_->accept(listener);
  asio::post(state_->io, [&s = *state_] { s.look_at_networks(); });
  state_->thread = std::thread([this] {
    pthread_setname_np(pthread_self(), "network");  // for `top -H`
    state_->run();
  });
}

std::vector<std::string> WebServer::change_listeners(const std::vector<ListenerSettings>& wanted) {
  struct Change {
    Listener& listener;
    ListenerSettings settings;
    std::optional<asio::ssl::context> tls;
  };
  State& s = *state_;
  const auto place = [](const ListenerSettings& one) { return std::tuple(one.socket, one.address, one.port); };
  auto changes = std::make_shared<std::vector<Change>>();
  std::vector<ListenerSettings> fresh = wanted;
  std::vector<std::string> later;
  auto listener = s.listeners.begin();
  for (const ListenerSettings& now : s.settings.listeners) {  // as of the start; no thread changes these
    Listener& there = *listener++;
    const auto found = std::ranges::find(fresh, place(now), place);
    if (found == fresh.end()) {
      later.push_back(now.url(now.port) + ": not in the configuration any more, served until the next start");
      continue;
    }
    changes->push_back({there, *found, found->encrypted() ? std::optional(tls_of(*found)) : std::nullopt});
    fresh.erase(found);
  }
  for (const ListenerSettings& other : fresh)
    later.push_back(other.url(other.port) + ": a new address takes effect at the next start");
  asio::post(s.io, [&s, changes] {
    for (Change& change : *changes) {
      const bool other_token = change.settings.token != change.listener.settings.token;
      if (other_token) change.listener.login = Login(change.settings.token);
      change.listener.settings = std::move(change.settings);
      change.listener.tls = std::move(change.tls);
      const bool nobody = !change.listener.settings.permissions.has(Permission::view);
      for (const auto& viewer : s.viewers())
        if (&viewer->listener() == &change.listener && (other_token || nobody))
          viewer->leave(websocket::close_code::policy_error);
    }
  });
  return later;
}

void WebServer::greet() {
  asio::post(state_->io, [&s = *state_] {
    for (const auto& viewer : s.viewers())
      viewer->offer_text("hello", s.handlers.hello(viewer->listener().settings.permissions));
  });
}

void WebServer::publish(std::shared_ptr<const StreamMessage> message) {
  asio::post(state_->io, [&s = *state_, message = std::move(message)] { s.publish(message); });
}

void WebServer::publish_text(const std::string& kind, std::string text) {
  asio::post(state_->io, [&s = *state_, kind, text = std::move(text)] { s.publish_text(kind, text); });
}

std::chrono::steady_clock::time_point WebServer::last_turn() {
  asio::post(state_->io, [&s = *state_] { s.last_turn = std::chrono::steady_clock::now(); });
  return state_->last_turn;
}

void WebServer::stop() {
  State& s = *state_;
  if (!s.thread.joinable()) return;
  asio::post(s.io, [&s] {
    error_code ignored;
    for (Listener& listener : s.listeners) {
      std::visit([&](auto& acceptor) { acceptor.close(ignored); }, listener.acceptor);
      if (!listener.settings.socket.empty()) std::remove(listener.settings.socket.c_str());
    }
    for (const auto& viewer : s.viewers()) viewer->leave(websocket::close_code::going_away);
    s.stop_timer.expires_after(s.viewers().empty() ? std::chrono::milliseconds(0) : kStream.goodbye);
    s.stop_timer.async_wait([&s](error_code) { s.io.stop(); });
  });
  s.thread.join();
}

}  // namespace lumigraft::server
