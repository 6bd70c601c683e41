#pragma once
// Writes one video track into a Matroska file (RFC 9559), picture by picture, so that whatever ends the program or
// fills the disk leaves a file that plays up to its last whole picture.
//
// Times are kept to the nanosecond: libav's own writer rounds to milliseconds. Each picture is a cluster of its own,
// written by one call; the segment has no declared length and no index, so nothing is mended at the end.
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lumigraft::capture {

struct MatroskaTrack {
  std::string codec;  ///< V_FFV1, V_MJPEG or V_UNCOMPRESSED
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> codec_private = {};  ///< V_FFV1: the decoder's set-up
  std::array<char, 4> uncompressed_fourcc{};     ///< V_UNCOMPRESSED: what the bytes are
};

class MatroskaFile {
 public:
  /// BlockAddID of a picture's own exposure: eight bytes, an IEEE 754 number, most significant byte first.
  static constexpr std::uint64_t kExposureId = 100;

  /// Throws std::runtime_error.
  MatroskaFile(const std::filesystem::path& file, const MatroskaTrack& track);
  ~MatroskaFile();
  MatroskaFile(const MatroskaFile&) = delete;
  MatroskaFile& operator=(const MatroskaFile&) = delete;

  /// `time_ns` is not negative; `exposure` is kept beside the picture where given. Throws std::runtime_error where the
  /// disk takes no more; the file ends with the picture before then.
  void append(std::int64_t time_ns, std::span<const std::uint8_t> picture,
              std::optional<double> exposure = std::nullopt);

 private:
  void write(const std::vector<std::span<const std::uint8_t>>& pieces);

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::int64_t length_ = 0;  ///< of what is whole
};

}  // namespace lumigraft::capture
