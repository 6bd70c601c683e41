#include "server/publish/publish_url.h"

#include "server/publish/url_parts.h"

namespace lumigraft::server {

std::optional<PublishUrl> read_publish_url(std::string_view text) {
  const std::optional<UrlParts> parts = split_url(text);
  if (!parts) return std::nullopt;
  PublishUrl found{std::string(text), "", parts->scheme + "://" + parts->authority()};
  if (parts->scheme == "rtsp" && parts->path.size() > 1) {
    found.muxer = "rtsp";
    found.shown += parts->path;
  } else if (parts->scheme == "srt" && parts->port) {
    found.muxer = "mpegts";
  } else if (parts->scheme == "rtp" && parts->port) {
    found.muxer = "rtp";
  } else {
    return std::nullopt;
  }
  return found;
}

std::string shown_of_refused(std::string_view text) {
  if (const std::optional<UrlParts> parts = split_url(text)) return parts->scheme + "://" + parts->authority();
  const std::size_t scheme_end = text.find("://");
  return scheme_end == std::string_view::npos ? "no URL" : std::string(text.substr(0, scheme_end + 3)) + "...";
}

}  // namespace lumigraft::server
