#pragma once
// Reads a list of image files: "timestamp_s path [exposure]" per line, '#' comments (the TUM RGB-D layout).
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace lumigraft::capture {

struct ListedPicture {
  std::int64_t time_ns = 0;
  std::filesystem::path path;  ///< relative to the list's folder
  std::string name;            ///< as written in the list
  std::optional<double> exposure;
  int line = 0;
};

/// What a list may contain.
struct ListRules {
  bool exposures = false;  ///< a third column
  bool brackets = false;   ///< several images of one time
};

/// At least one image, in time order. Throws InputError with file and line.
std::vector<ListedPicture> read_picture_list(const std::filesystem::path& list, const ListRules& rules);

}  // namespace lumigraft::capture
