#include "server/commands/viewer_text.h"

#include <algorithm>
#include <string_view>

namespace lumigraft::server {

std::string without_folders(const std::string& text) {
  constexpr std::string_view kBefore = " \t\n\"'([=:", kAfter = " \t\n\"')],;:";
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const bool begins = text[at] == '/' && (at == 0 || kBefore.find(text[at - 1]) != std::string_view::npos);
    const std::size_t end = std::min(text.find_first_of(kAfter, at), text.size());
    const std::size_t last = begins ? text.rfind('/', end - 1) : at;
    if (last > at) {  // a path of two names or more
      out += text.substr(last + 1, end - last - 1);
      at = end;
    } else {
      out += text[at++];
    }
  }
  return out;
}

}  // namespace lumigraft::server
