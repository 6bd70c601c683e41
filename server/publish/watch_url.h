#pragma once
// server.watch of the configuration: where the page /watch.html gets the published stream (WHEP).
#include <optional>
#include <string>
#include <string_view>

namespace lumigraft::server {

struct WatchUrl {
  std::string url;     ///< empty: there is none
  std::string origin;  ///< what the page may connect to

  bool operator==(const WatchUrl&) const = default;
};

inline constexpr const char* kWatchAllowed = "\"https://HOST/PATH\" or \"http://HOST/PATH\", without a password";

/// None where it is none of kWatchAllowed.
std::optional<WatchUrl> read_watch_url(std::string_view text);

}  // namespace lumigraft::server
