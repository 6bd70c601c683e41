#include "server/commands/unused_file.h"

#include <string>

#include "server/commands/parameters.h"

namespace lumigraft::server {

void keep_as_unused(const std::filesystem::path& file) {
  const auto name = [&](int number) {
    return std::filesystem::path(file.string() + ".unused" + (number > 1 ? std::to_string(number) : ""));
  };
  int last = 1;
  while (last < kCommands.max_unused && std::filesystem::exists(name(last))) ++last;
  for (; last > 1; --last) std::filesystem::rename(name(last - 1), name(last));
  std::filesystem::rename(file, name(1));
}

}  // namespace lumigraft::server
