#pragma once
// What a session says of where a camera's pictures come from: `source = "KIND:REST"`.
#include <optional>
#include <string>

namespace lumigraft::capture {

/// For errors. A new kind of camera is added here, in source_uri.cpp, and in open_frames.cpp.
inline constexpr const char* kSourceKinds = "images:LIST, mkv:FILE, oni:FILE, openni2:, v4l2:, libcamera:, aravis:";

struct SourceUri {
  std::string kind;
  std::string rest;
  bool live = false;  ///< a device; else a file
};

/// Empty where it is of no kind that this build knows.
std::optional<SourceUri> parse_source(const std::string& uri);

}  // namespace lumigraft::capture
