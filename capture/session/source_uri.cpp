#include "capture/session/source_uri.h"

#include <map>

namespace lumigraft::capture {

std::optional<SourceUri> parse_source(const std::string& uri) {
  static const std::map<std::string, bool> kLive = {{"images", false}, {"mkv", false},     {"oni", false},
                                                    {"openni2", true}, {"v4l2", true},     {"libcamera", true},
                                                    {"aravis", true},  {"freenect", true}, {"helper", true}};
  const std::size_t colon = uri.find(':');
  const auto kind = kLive.find(uri.substr(0, colon));
  if (colon == std::string::npos || kind == kLive.end()) return std::nullopt;
  return SourceUri{kind->first, uri.substr(colon + 1), kind->second};
}

}  // namespace lumigraft::capture
