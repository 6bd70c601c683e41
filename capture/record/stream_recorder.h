#pragma once
// One stream of a session into one Matroska file, without loss: depth as FFV1 or as it came, pictures as the camera
// gave them.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "capture/frame.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class MatroskaFile;

enum class DepthCoding {
  ffv1,          ///< a quarter of the size, for 10 ms of a core a picture of 640x480
  uncompressed,  ///< for the price of a copy
};

class StreamRecorder {
 public:
  /// Throws InputError where `file` is there already.
  StreamRecorder(std::filesystem::path file, const StreamSpec& spec, DepthCoding coding = DepthCoding::ffv1);
  ~StreamRecorder();

  /// False where the item holds nothing that can be kept: a lost picture, one whose time goes back, which no replay
  /// would show, or one in another format than the first. Throws InputError for radiance pictures, std::runtime_error
  /// where the disk takes no more.
  bool write(const SourceItem& item);

  std::uint64_t pictures() const { return pictures_; }

 private:
  class DepthEncoder;

  bool in_order(std::int64_t time_ns);

  std::filesystem::path file_;
  StreamSpec spec_;
  DepthCoding coding_;
  std::unique_ptr<DepthEncoder> encoder_;
  std::unique_ptr<MatroskaFile> out_;       ///< made with the first picture
  PixelFormat format_ = PixelFormat::rgb8;  ///< of the first picture
  std::int64_t last_time_ns_ = -1;
  std::uint64_t pictures_ = 0;
};

}  // namespace lumigraft::capture
