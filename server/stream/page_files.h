#pragma once
// The table that embed_page.cmake generates from server/web.
#include <cstddef>

namespace lumigraft::server {

struct EmbeddedFile {
  const char* name;
  const unsigned char* bytes;
  std::size_t size;
};
extern const EmbeddedFile embedded_page_files[];  ///< ends with a null name

}  // namespace lumigraft::server
