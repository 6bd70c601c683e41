#pragma once
// images:LIST - image files named with their times in a list.
#include <filesystem>
#include <map>
#include <variant>

#include "capture/formats/picture_file.h"
#include "capture/formats/picture_list.h"
#include "capture/recorded/seekable.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class ImageSource : public Source, public Seekable {
 public:
  /// Checks every file of the list (existence, header, size, bit depth) and decodes the first. Throws InputError. A
  /// file that cannot be decoded later becomes a LostFrame.
  ImageSource(const std::filesystem::path& list, const StreamSpec& spec);

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override { return next_ == pictures_.size(); }
  void rewind() override { next_ = 0; }
  std::int64_t first_time_ns() const override { return pictures_.front().time_ns; }
  std::optional<std::int64_t> last_time_ns() const override { return pictures_.back().time_ns; }
  void skip_to(std::int64_t time_ns) override;

 private:
  using Decoded = std::variant<Image<std::uint8_t>, Image<std::uint16_t>, Image<float>>;

  void require(const PictureHeader& header) const;
  std::shared_ptr<const Decoded> decode(const ListedPicture& picture);

  StreamSpec spec_;
  std::vector<ListedPicture> pictures_;
  std::size_t next_ = 0;
  std::map<std::filesystem::path, int> uses_;  ///< number of times that the list names each file
  /// The most recent images that the list names more than once, oldest first.
  std::vector<std::pair<std::filesystem::path, std::shared_ptr<const Decoded>>> cache_;
};

}  // namespace lumigraft::capture
