#pragma once
// The files of server/web, compiled into the program.
#include <optional>
#include <string_view>

namespace lumigraft::server {

struct PageFile {
  std::string_view name;  ///< "index.html"
  std::string_view type;  ///< for the Content-Type header
  std::string_view bytes;
};

/// Looks up a request path; "/" is index.html. Empty where there is no such file.
std::optional<PageFile> find_page_file(std::string_view path);

}  // namespace lumigraft::server
