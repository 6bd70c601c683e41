#include "server/stream/request_guard.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/address.hpp>
#include <cctype>
#include <string>

namespace lumigraft::server {
namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

/// Removes the port from "[::1]:8080" or "localhost:8080". Empty where what follows the name is no port.
std::string_view without_port(std::string_view host) {
  const std::size_t from = host.starts_with('[') ? host.find(']') : 0;
  if (from == std::string_view::npos) return {};
  const std::size_t colon = host.find(':', from);
  const std::string_view name = host.substr(0, colon);
  if (host.starts_with('[') && !name.ends_with(']')) return {};
  if (colon == std::string_view::npos) return name;
  const std::string_view port = host.substr(colon + 1);
  return std::ranges::all_of(port, [](unsigned char c) { return std::isdigit(c) != 0; }) ? name : std::string_view();
}

/// Of "127.0.0.1" or "[::1]"; empty if it is a name.
boost::asio::ip::address address_of(std::string_view name) {
  boost::system::error_code error;
  const bool v6 = name.starts_with('[') && name.ends_with(']') && name.size() > 2;
  const std::string text(v6 ? name.substr(1, name.size() - 2) : name);
  const auto address = boost::asio::ip::make_address(text, error);
  return error || address.is_v6() != v6 ? boost::asio::ip::address() : address;
}

bool is_address(std::string_view name) {
  return !address_of(name).is_unspecified() || name == "0.0.0.0" || name == "[::]";
}

std::string name_of_machine() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? lower(name.data()) : std::string();
}

bool host_allowed(std::string_view name, const ListenerSettings& listener) {
  if (!listener.socket.empty()) return true;
  if (name.empty()) return false;
  if (std::ranges::any_of(listener.allowed_hosts, [&](const std::string& one) { return lower(one) == name; }))
    return true;
  if (name == "localhost") return true;
  if (listener.local()) return address_of(name).is_loopback();
  const std::string machine = name_of_machine();
  return is_address(name) || (!machine.empty() && (name == machine || name == machine + ".local"));
}

}  // namespace

bool request_allowed(std::string_view host, std::string_view origin, const ListenerSettings& listener) {
  const std::string to = lower(host);
  if (!host_allowed(without_port(to), listener)) return false;
  if (origin.empty()) return true;
  const std::string from = lower(origin);
  return from == "http://" + to || from == "https://" + to ||
         std::ranges::any_of(listener.allowed_origins, [&](const std::string& one) { return lower(one) == from; });
}

}  // namespace lumigraft::server
