#pragma once
// server.publish of the configuration: where the stream is published.
#include <optional>
#include <string>
#include <string_view>

namespace lumigraft::server {

struct PublishUrl {
  std::string url;    ///< as configured: may hold a password
  std::string muxer;  ///< libavformat's name of the format that this scheme carries
  std::string shown;  ///< scheme, host, port and the path of RTSP: what logs may say

  bool operator==(const PublishUrl&) const = default;
};

inline constexpr const char* kPublishAllowed =
    "\"rtsp://HOST/PATH\", \"srt://HOST:PORT?streamid=...\" or \"rtp://HOST:PORT\"";

/// None where it is none of kPublishAllowed.
std::optional<PublishUrl> read_publish_url(std::string_view text);

/// What an error message may say of a text that is no such URL: never a password.
std::string shown_of_refused(std::string_view text);

}  // namespace lumigraft::server
