#pragma once
// The file in which a service keeps where its tags are.
#include <filesystem>
#include <optional>
#include <string>

#include "capture/session/session.h"
#include "reconstruct/pose/tag_map.h"

namespace lumigraft::server {

class TagMapFile {
 public:
  /// Reads `file` if it exists. One that cannot be used is never overwritten: the first save keeps it as FILE.unused
  /// (unused_file.h).
  TagMapFile(std::filesystem::path file, capture::Tag tag);

  /// Empty if there is no file, or none that can be used.
  const std::optional<reconstruct::TagMap::State>& learnt() const { return learnt_; }
  /// One line: that the file was read, or why it is not used. Empty without a file.
  const std::string& message() const { return message_; }
  /// Atomic. Returns why it failed, in one line, the first time; later failures are silent until a save succeeds.
  std::string save(const reconstruct::TagMap::State& state);

 private:
  std::filesystem::path file_;
  capture::Tag tag_;
  std::optional<reconstruct::TagMap::State> learnt_;
  std::string message_;
  bool unusable_ = false;  ///< the file that exists must be kept
  bool failed_ = false;    ///< the last save
};

/// The default file: KIOSK.tags.toml of KIOSK.toml.
std::filesystem::path default_tag_map(const std::filesystem::path& configuration);

}  // namespace lumigraft::server
