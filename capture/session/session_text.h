#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace lumigraft::capture {

/// The TOML text from which a session's cameras were read. Recordings copy the text, so that no number is rounded.
struct SessionText {
  std::filesystem::path file;
  std::vector<std::string> overrides;  ///< KEY=VALUE, applied to the file's text
};

/// The file's text with the overrides applied. Throws InputError.
std::string text_with_overrides(const SessionText& text);

}  // namespace lumigraft::capture
