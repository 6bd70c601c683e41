#pragma once
// Folders of recorded sessions, and statistics of the errors in them.
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace lumigraft::test {

/// Of the recording in the repository, or of a session in LUMIGRAFT_EXTRA, which may be missing.
inline std::filesystem::path folder_of(const std::string& session) {
  if (session == "recording") return std::filesystem::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop";
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  return extra ? std::filesystem::path(extra) / "sessions" / session : std::filesystem::path();
}

/// 0 without values.
inline double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace lumigraft::test
