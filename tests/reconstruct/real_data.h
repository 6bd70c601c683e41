#pragma once
// Real captures that are not part of the repository: LUMIGRAFT_EXTRA names a folder that contains data/.
#include <cstdlib>
#include <filesystem>
#include <optional>

namespace lumigraft::test {

/// Empty if it is missing: then the test is skipped.
inline std::optional<std::filesystem::path> data_folder(const char* name) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const auto folder = std::filesystem::path(extra ? extra : "") / "data" / name;
  return extra && std::filesystem::exists(folder) ? std::optional(folder) : std::nullopt;
}

}  // namespace lumigraft::test
