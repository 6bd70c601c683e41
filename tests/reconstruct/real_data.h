#pragma once
// Real captures that are no part of the project: LUMIGRAFT_EXTRA names a folder that has data/.
#include <cstdlib>
#include <filesystem>
#include <optional>

namespace lumigraft::test {

/// Empty where it is missing: the test skips and says so.
inline std::optional<std::filesystem::path> data_folder(const char* name) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const auto folder = std::filesystem::path(extra ? extra : "") / "data" / name;
  return extra && std::filesystem::exists(folder) ? std::optional(folder) : std::nullopt;
}

}  // namespace lumigraft::test
