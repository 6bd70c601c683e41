#pragma once
// Index of a Matroska file, made from the headers of its elements without reading the frames themselves.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace lumigraft::capture {

/// Container time of the last complete frame, nanoseconds. Empty if the headers do not contain it: clusters of unknown
/// length, or no Matroska file.
std::optional<std::int64_t> matroska_end_ns(const std::filesystem::path& file);

/// Consecutive frames; clusters follow each other in time.
struct MatroskaCluster {
  std::int64_t position = 0;        ///< in the file, bytes
  std::int64_t ticks = 0;           ///< container time, not later than that of the first frame
  std::uint64_t frames_before = 0;  ///< in the file
  bool key = false;                 ///< the first frame is decodable without earlier ones
};

/// Clusters of a file with one track, up to where the file is cut or time does not increase. Empty as above.
std::vector<MatroskaCluster> matroska_clusters(const std::filesystem::path& file);

}  // namespace lumigraft::capture
