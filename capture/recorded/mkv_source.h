#pragma once
// mkv:FILE - one video stream in Matroska: FFV1 gray16 or uncompressed for depth; for colour what the camera gave
// (MJPEG or uncompressed) or 8-bit FFV1. Times are the container's: exact in what `lumigraft record` wrote, rounded to
// 1 ms by most other programs. A file that was cut short plays up to the cut.
#include <filesystem>

#include "capture/formats/matroska_index.h"
#include "capture/recorded/seekable.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class MkvSource : public Source, public Seekable {
 public:
  /// Opens the file and decodes its first picture. Throws InputError. Damage found later becomes a LostPicture.
  MkvSource(const std::filesystem::path& file, const StreamSpec& spec);
  ~MkvSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override;
  std::int64_t first_time_ns() const override { return first_time_ns_; }
  std::optional<std::int64_t> last_time_ns() const override;
  void skip_to(std::int64_t time_ns) override;

 private:
  class Reader;
  std::filesystem::path file_;
  StreamSpec spec_;
  std::unique_ptr<Reader> reader_;
  std::int64_t first_time_ns_ = 0;
  std::optional<std::vector<MatroskaCluster>> clusters_;  ///< once somebody skips
  std::optional<SourceItem> ahead_;  ///< read before it is asked for, so that finished() is true after the last picture
};

}  // namespace lumigraft::capture
