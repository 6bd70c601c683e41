#pragma once
// The file in which a service with live cameras keeps views of its room.
#include <chrono>
#include <filesystem>
#include <string>

#include "capture/session/session.h"
#include "reconstruct/pose/keyframe_map.h"

namespace lumigraft::server {

class ViewsFile {
 public:
  /// Reads `file` if it exists. One that cannot be used is never overwritten: the first save keeps it as FILE.unused
  /// (unused_file.h).
  ViewsFile(std::filesystem::path file, const capture::Session& session);

  /// Empty if there is no file, or none that can be used.
  const reconstruct::KeyframeMap::Views& views() const { return views_; }
  /// One line: that the file was read, or why it is not used. Empty without a file.
  const std::string& message() const { return message_; }
  /// Returns why it failed, in one line, the first time; later failures are silent until a save succeeds.
  std::string save(const reconstruct::KeyframeMap::Views& views);

 private:
  std::filesystem::path file_;
  capture::Tag tag_;
  capture::CameraModel color_;
  reconstruct::KeyframeMap::Views views_;
  std::string message_;
  bool unusable_ = false;  ///< the file that exists must be kept
  bool failed_ = false;    ///< the last save
};

/// KIOSK.views.yml.gz of KIOSK.toml.
std::filesystem::path views_file_of(const std::filesystem::path& configuration);

}  // namespace lumigraft::server
