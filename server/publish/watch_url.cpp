#include "server/publish/watch_url.h"

#include "server/publish/url_parts.h"

namespace lumigraft::server {

std::optional<WatchUrl> read_watch_url(std::string_view text) {
  const std::optional<UrlParts> parts = split_url(text);
  if (!parts || parts->credentials || (parts->scheme != "https" && parts->scheme != "http")) return std::nullopt;
  if (parts->path.empty()) return std::nullopt;
  return WatchUrl{std::string(text), parts->scheme + "://" + parts->authority()};
}

}  // namespace lumigraft::server
