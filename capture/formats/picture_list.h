#pragma once
// A list of pictures with their times: "timestamp_s path [exposure]" per line, '#' comments (the TUM RGB-D layout).
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace lumigraft::capture {

struct ListedPicture {
  std::int64_t time_ns = 0;
  std::filesystem::path path;  ///< beside the list
  std::string name;            ///< as the list spells it
  std::optional<double> exposure;
  int line = 0;
};

/// Which lists may hold what.
struct ListRules {
  bool exposures = false;  ///< a third column
  bool brackets = false;   ///< several pictures at one time
};

/// Throws InputError with file and line; times never go back in what it returns, and there is at least one picture.
std::vector<ListedPicture> read_picture_list(const std::filesystem::path& list, const ListRules& rules);

/// "12.345678901" to nanoseconds without rounding through a double. Empty where it is no such number.
std::optional<std::int64_t> parse_seconds(std::string_view text);

}  // namespace lumigraft::capture
