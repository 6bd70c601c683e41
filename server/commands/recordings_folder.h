#pragma once
// The folder of a service's recordings, whose size is bounded: the oldest go for new ones. Only recordings that a
// service made are counted and removed: their folders contain the file kMark. Who deletes that file keeps the
// recording.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

class RecordingsFolder {
 public:
  static constexpr const char* kMark = "made-by-lumigraft.txt";
  /// Free bytes of the disk of a folder.
  using FreeBytes = std::function<std::uintmax_t(const std::filesystem::path&)>;

  RecordingsFolder(std::filesystem::path folder, const RecordingLimits& limits, FreeBytes free_bytes = disk_free_bytes);

  /// A folder for a recording that begins now, which does not exist yet; named by its time.
  std::filesystem::path new_recording() const;
  /// Marks a recording that exists as made by a service, and as newer than all others of its folder, also after the
  /// clock was set back. Throws std::runtime_error.
  static void mark(const std::filesystem::path& recording);
  /// Removes the oldest recordings until the limits are kept. Never `written`. Where that would not suffice, removes
  /// none and returns what is wrong, else an empty text. Takes as long as the disk takes to remove files.
  std::string make_room(const std::filesystem::path& written) const;

  const std::filesystem::path& folder() const { return folder_; }
  static std::uintmax_t disk_free_bytes(const std::filesystem::path& folder);

 private:
  const std::filesystem::path folder_;
  const RecordingLimits limits_;
  const FreeBytes free_bytes_;
};

}  // namespace lumigraft::server
