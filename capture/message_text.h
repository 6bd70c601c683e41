#pragma once
// Text of messages and reports.
#include <string>
#include <vector>

namespace lumigraft::capture {

/// As std::printf writes it.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// Line breaks become spaces.
std::string on_one_line(std::string text);

/// The words with ", " between them.
std::string listed(const std::vector<std::string>& words);

}  // namespace lumigraft::capture
