#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace lumigraft::capture {

/// Where a session's cameras were read from: its text is kept, so that no number is rounded on the way.
struct SessionText {
  std::filesystem::path file;
  std::vector<std::string> overrides;  ///< KEY=VALUE laid over it
};

/// One text that says the same. Throws InputError.
std::string text_with_overrides(const SessionText& text);

}  // namespace lumigraft::capture
