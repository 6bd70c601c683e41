#include "server/stream/page.h"

#include "server/stream/page_files.h"

namespace lumigraft::server {
namespace {

const char* type_of(std::string_view name) {
  const std::string_view extension = name.substr(name.rfind('.') + 1);
  if (extension == "html") return "text/html; charset=utf-8";
  if (extension == "js") return "text/javascript; charset=utf-8";
  if (extension == "css") return "text/css; charset=utf-8";
  if (extension == "svg") return "image/svg+xml";
  if (extension == "png") return "image/png";
  return "application/octet-stream";
}

}  // namespace

WebReply page_reply(std::string_view path) {
  const std::string_view name = path == "/" ? "index.html" : path.substr(path.empty() ? 0 : 1);
  for (const EmbeddedFile* file = embedded_page_files; file->name != nullptr; ++file) {
    if (name == file->name) return {200, type_of(name), {reinterpret_cast<const char*>(file->bytes), file->size}};
  }
  return {.status = 404, .body = "no such page\n"};
}

}  // namespace lumigraft::server
