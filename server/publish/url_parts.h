#pragma once
// The parts of a URL with a host: scheme://[credentials@]host[:port][/path][?query]
#include <optional>
#include <string>
#include <string_view>

namespace lumigraft::server {

struct UrlParts {
  std::string scheme;        ///< in lower case
  bool credentials = false;  ///< whether there are a name or a password
  std::string host;          ///< an IPv6 address in its brackets
  std::optional<int> port;   ///< 1 to 65535
  std::string path;          ///< with its slash; may be empty
  bool query = false;

  /// As "host:port" or "host".
  std::string authority() const;
};

/// None where the text is not of this form.
std::optional<UrlParts> split_url(std::string_view text);

}  // namespace lumigraft::server
