#pragma once
// Records one stream into a Matroska file without loss: depth as FFV1 or uncompressed, colour and fish-eye in the
// camera's pixel format.
#include <cstdint>
#include <filesystem>
#include <memory>

#include "capture/frame.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class MatroskaFile;

enum class DepthCoding {
  ffv1,          ///< a quarter of the size; takes 5 to 10 ms of a core per frame of 640x480
  uncompressed,  ///< costs one copy
};

class StreamRecorder {
 public:
  /// Throws InputError if `file` exists.
  StreamRecorder(std::filesystem::path file, const StreamSpec& spec, DepthCoding coding = DepthCoding::ffv1);
  ~StreamRecorder();

  /// False for items that cannot be stored: lost frames, frames whose time does not increase, which no replay would
  /// show, and frames in another format than the first. Throws InputError for frames of radiance, std::runtime_error if
  /// writing fails.
  bool write(const SourceItem& item);

  std::uint64_t frames() const { return frames_; }

 private:
  class DepthEncoder;

  bool in_order(std::int64_t time_ns);

  std::filesystem::path file_;
  StreamSpec spec_;
  DepthCoding coding_;
  std::unique_ptr<DepthEncoder> encoder_;
  std::unique_ptr<MatroskaFile> out_;       ///< created with the first frame
  PixelFormat format_ = PixelFormat::rgb8;  ///< of the first frame
  std::int64_t last_time_ns_ = -1;
  std::uint64_t frames_ = 0;
};

}  // namespace lumigraft::capture
