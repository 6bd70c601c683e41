#pragma once
// The file in which a service keeps its room.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "capture/session/session.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/scene_builder.h"

namespace lumigraft::server {

class KeptRoomFile {
 public:
  /// Reads `file` if it exists. One that cannot be used, or is of another room, is never overwritten: the first save
  /// keeps it as FILE.unused (unused_file.h).
  KeptRoomFile(std::filesystem::path file, capture::Tag tag, const reconstruct::FusionSettings& fusion);

  /// The room that was read; empty if there is none that can be used, and from the second call on.
  std::optional<reconstruct::KeptRoom> take() { return std::exchange(room_, std::nullopt); }
  /// One line: that the file was read, or why it is not used. Empty without a file.
  const std::string& message() const { return message_; }
  /// Returns why it failed, in one line, the first time; later failures are silent until a save succeeds.
  std::string save(const reconstruct::RoomToKeep& room);
  /// Bytes of the last save that succeeded, else of the file that was read.
  std::uintmax_t size() const { return size_; }

 private:
  std::filesystem::path file_;
  capture::Tag tag_;
  std::optional<reconstruct::KeptRoom> room_;
  std::string message_;
  std::uintmax_t size_ = 0;
  bool unusable_ = false;  ///< the file that exists must be kept,
  bool renamed_ = false;   ///< and was, as far as it is of another room
  bool failed_ = false;    ///< the last save
};

/// The default file: KIOSK.room of KIOSK.toml.
std::filesystem::path default_kept_room(const std::filesystem::path& configuration);

}  // namespace lumigraft::server
