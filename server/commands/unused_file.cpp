#include "server/commands/unused_file.h"

#include <string>

namespace lumigraft::server {

void keep_as_unused(const std::filesystem::path& file) {
  std::filesystem::path name = file.string() + ".unused";
  for (int i = 2; std::filesystem::exists(name); ++i) name = file.string() + ".unused" + std::to_string(i);
  std::filesystem::rename(file, name);
}

}  // namespace lumigraft::server
