#pragma once
// mkv:FILE - one video stream in Matroska. Depth: FFV1 gray16 or uncompressed. Colour: the camera's own format (MJPEG
// or uncompressed) or 8-bit FFV1. Times are the container's: exact in recordings of `lumigraft record`, rounded to 1 ms
// by most other programs. A truncated file plays up to its end.
#include <filesystem>

#include "capture/formats/matroska_index.h"
#include "capture/recorded/seekable.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class MkvSource : public Source, public Seekable {
 public:
  /// Opens the file and decodes its first frame. Throws InputError. Frames damaged later become a LostFrame.
  MkvSource(const std::filesystem::path& file, const StreamSpec& spec);
  ~MkvSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override { return !ahead_; }
  void rewind() override;
  std::int64_t first_time_ns() const override { return first_time_ns_; }
  std::optional<std::int64_t> last_time_ns() const override { return matroska_end_ns(file_); }
  void skip_to(std::int64_t time_ns) override;

 private:
  class Reader;
  std::filesystem::path file_;
  StreamSpec spec_;
  std::unique_ptr<Reader> reader_;
  std::int64_t first_time_ns_ = 0;
  std::optional<std::vector<MatroskaCluster>> clusters_;  ///< read by the first skip_to()
  std::optional<SourceItem> ahead_;  ///< read in advance, so that finished() is true after the last frame
};

}  // namespace lumigraft::capture
