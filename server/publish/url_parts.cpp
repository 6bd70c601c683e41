#include "server/publish/url_parts.h"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace lumigraft::server {
namespace {

/// What a host may be made of; a bracketed address has colons as well.
bool host_like(std::string_view host) {
  const bool v6 = host.starts_with('[') && host.ends_with(']');
  const std::string_view inner = v6 ? host.substr(1, host.size() - 2) : host;
  return !inner.empty() && std::ranges::all_of(inner, [v6](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' || (v6 && (c == ':' || c == '%'));
  });
}

std::optional<int> port_of(std::string_view text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port < 1 || port > 65535) return std::nullopt;
  return port;
}

}  // namespace

std::string UrlParts::authority() const { return port ? host + ':' + std::to_string(*port) : host; }

std::optional<UrlParts> split_url(std::string_view text) {
  const std::size_t scheme_end = text.find("://");
  if (scheme_end == std::string_view::npos || scheme_end == 0) return std::nullopt;
  if (std::ranges::any_of(text, [](unsigned char c) { return c <= ' ' || c >= 0x7f; })) return std::nullopt;
  UrlParts parts;
  for (const unsigned char c : text.substr(0, scheme_end)) parts.scheme += static_cast<char>(std::tolower(c));
  const std::string_view rest = text.substr(scheme_end + 3);
  const std::size_t authority_end = std::min(rest.find_first_of("/?#"), rest.size());
  std::string_view authority = rest.substr(0, authority_end);
  std::string_view path = rest.substr(authority_end);
  const std::size_t query = path.find_first_of("?#");
  parts.query = query != std::string_view::npos;
  parts.path = path.substr(0, query);
  if (const std::size_t at = authority.rfind('@'); at != std::string_view::npos) {
    parts.credentials = true;
    authority.remove_prefix(at + 1);
  }
  const std::size_t bracket = authority.rfind(']');
  const std::size_t colon = authority.find(':', bracket == std::string_view::npos ? 0 : bracket);
  parts.host = authority.substr(0, colon);
  if (!host_like(parts.host)) return std::nullopt;
  if (colon != std::string_view::npos) {
    parts.port = port_of(authority.substr(colon + 1));
    if (!parts.port) return std::nullopt;
  }
  return parts;
}

}  // namespace lumigraft::server
