#include "server/stream/request_guard.h"

#include <algorithm>
#include <cctype>
#include <string>

namespace lumigraft::server {
namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

/// Removes the port from "[::1]:8080" or "localhost:8080".
std::string_view without_port(std::string_view host) {
  const std::size_t from = host.starts_with('[') ? host.find(']') : 0;
  if (from == std::string_view::npos) return host;
  return host.substr(0, host.find(':', from));
}

}  // namespace

bool request_allowed(std::string_view host, std::string_view origin, bool bound_to_loopback) {
  const std::string to = lower(host);
  if (bound_to_loopback) {
    const std::string_view name = without_port(to);
    if (name != "localhost" && name != "127.0.0.1" && name != "[::1]") return false;
  }
  if (origin.empty()) return true;
  const std::string from = lower(origin);
  return from == "http://" + to || from == "https://" + to;
}

}  // namespace lumigraft::server
