#pragma once
// The files of server/web, built into the program.
#include <optional>
#include <string_view>

namespace lumigraft::server {

struct PageFile {
  std::string_view name;  ///< "index.html"
  std::string_view type;  ///< of the Content-Type header
  std::string_view bytes;
};

/// `path` as in a request, "/" being the index. Empty where there is no such file.
std::optional<PageFile> find_page_file(std::string_view path);

}  // namespace lumigraft::server
