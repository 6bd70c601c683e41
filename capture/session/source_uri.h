#pragma once
// URI of a camera or recording in a session file: `source = "KIND:REST"`.
#include <optional>
#include <string>

namespace lumigraft::capture {

/// Kinds listed in error messages. A new kind is added here, in source_uri.cpp, and in open_frames.cpp.
inline constexpr const char* kSourceKinds =
    "images:LIST, mkv:FILE, oni:FILE, openni2:, v4l2:, libcamera:, aravis:, freenect:, helper:PROGRAM";

struct SourceUri {
  std::string kind, rest;
  bool live = false;  ///< a device, not a file
};

/// Empty if this build does not know the kind.
std::optional<SourceUri> parse_source(const std::string& uri);

}  // namespace lumigraft::capture
