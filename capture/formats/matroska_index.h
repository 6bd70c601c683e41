#pragma once
// Where the pictures of a Matroska file lie, told by the heads of its elements: nothing of its pictures is read.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace lumigraft::capture {

/// The container's time of the last picture that is there as a whole, nanoseconds. Empty where only reading everything
/// would tell: clusters whose length nobody wrote, or no Matroska.
std::optional<std::int64_t> matroska_end_ns(const std::filesystem::path& file);

/// Some pictures that follow each other, later than those before and earlier than those behind.
struct MatroskaCluster {
  std::int64_t position = 0;          ///< in the file, bytes
  std::int64_t ticks = 0;             ///< the container's time, no later than its first picture's
  std::uint64_t pictures_before = 0;  ///< in the file
  bool key = false;                   ///< its first picture needs none before it
};

/// Of a file with one track, up to where it is torn or time does not go on. Empty as above.
std::vector<MatroskaCluster> matroska_clusters(const std::filesystem::path& file);

}  // namespace lumigraft::capture
