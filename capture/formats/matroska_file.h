#pragma once
// Writes one video track into a Matroska file (RFC 9559), frame by frame. If the program ends or the disk fills up, the
// file plays up to its last complete frame.
//
// Times are exact to the nanosecond; libav's own writer rounds to milliseconds. Each frame is a cluster of its own,
// written by one call; the segment has no declared length and no index, so nothing has to be updated at the end.
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/descriptor.h"

namespace lumigraft::capture {

namespace matroska {
/// Element IDs of RFC 8794 (EBML) and RFC 9559 (Matroska).
enum Id : std::uint32_t {
  kEbml = 0x1A45DFA3,
  kEbmlVersion = 0x4286,
  kEbmlReadVersion = 0x42F7,
  kEbmlMaxIdLength = 0x42F2,
  kEbmlMaxSizeLength = 0x42F3,
  kDocType = 0x4282,
  kDocTypeVersion = 0x4287,
  kDocTypeReadVersion = 0x4285,
  kSegment = 0x18538067,
  kInfo = 0x1549A966,
  kTimestampScale = 0x2AD7B1,
  kMuxingApp = 0x4D80,
  kWritingApp = 0x5741,
  kTracks = 0x1654AE6B,
  kTrackEntry = 0xAE,
  kTrackNumber = 0xD7,
  kTrackUid = 0x73C5,
  kTrackType = 0x83,
  kFlagLacing = 0x9C,
  kCodecId = 0x86,
  kCodecPrivate = 0x63A2,
  kVideo = 0xE0,
  kPixelWidth = 0xB0,
  kPixelHeight = 0xBA,
  kUncompressedFourCc = 0x2EB524,
  kCluster = 0x1F43B675,
  kTimestamp = 0xE7,
  kSimpleBlock = 0xA3,
  kMaxBlockAdditionId = 0x55EE,
  kBlockGroup = 0xA0,
  kBlock = 0xA1,
  kReferenceBlock = 0xFB,
  kBlockAdditions = 0x75A1,
  kBlockMore = 0xA6,
  kBlockAddId = 0xEE,
  kBlockAdditional = 0xA5,
};
}  // namespace matroska

struct MatroskaTrack {
  std::string codec;  ///< V_FFV1, V_MJPEG or V_UNCOMPRESSED
  int width = 0, height = 0;
  std::vector<std::uint8_t> codec_private = {};  ///< V_FFV1: the decoder's configuration
  std::array<char, 4> uncompressed_fourcc{};     ///< V_UNCOMPRESSED: pixel format
};

class MatroskaFile {
 public:
  /// BlockAddID of a frame's own exposure: an IEEE 754 double, most significant byte first.
  static constexpr std::uint64_t kExposureId = 100;

  /// Throws std::runtime_error.
  MatroskaFile(const std::filesystem::path& file, const MatroskaTrack& track);

  /// `time_ns` is not negative; `exposure`, if given, is stored with the frame. Throws std::runtime_error if writing
  /// fails; the file then ends with the previous frame.
  void append(std::int64_t time_ns, std::span<const std::uint8_t> frame, std::optional<double> exposure = std::nullopt);

 private:
  void write(const std::vector<std::span<const std::uint8_t>>& pieces);

  std::filesystem::path file_;
  Descriptor descriptor_;
  std::int64_t length_ = 0;  ///< bytes up to the end of the last complete frame
};

}  // namespace lumigraft::capture
