#include "capture/formats/matroska_file.h"

#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace lumigraft::capture {
namespace {

using namespace matroska;
using Bytes = std::vector<std::uint8_t>;

void add_big_endian(Bytes& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void add_id(Bytes& out, Id id) { add_big_endian(out, id, id > 0xFFFFFF ? 4 : id > 0xFFFF ? 3 : id > 0xFF ? 2 : 1); }

/// A size of eight bytes: one length marker and 56 bits.
void add_size(Bytes& out, std::uint64_t size) { add_big_endian(out, size | (std::uint64_t{1} << 56), 8); }

void add(Bytes& out, Id id, std::span<const std::uint8_t> data) {
  add_id(out, id);
  add_size(out, data.size());
  out.insert(out.end(), data.begin(), data.end());
}

void add(Bytes& out, Id id, std::uint64_t value) {
  Bytes data;
  add_big_endian(data, value, 8);
  add(out, id, data);
}

void add(Bytes& out, Id id, const std::string& text) { add(out, id, Bytes(text.begin(), text.end())); }

Bytes file_header(const MatroskaTrack& track) {
  Bytes ebml;
  add(ebml, kEbmlVersion, 1);
  add(ebml, kEbmlReadVersion, 1);
  add(ebml, kEbmlMaxIdLength, 4);
  add(ebml, kEbmlMaxSizeLength, 8);
  add(ebml, kDocType, std::string("matroska"));
  add(ebml, kDocTypeVersion, 4);
  add(ebml, kDocTypeReadVersion, 2);

  Bytes info;
  add(info, kTimestampScale, 1);  // ticks of one nanosecond
  add(info, kMuxingApp, std::string("lumigraft"));
  add(info, kWritingApp, std::string("lumigraft"));

  Bytes video;
  add(video, kPixelWidth, static_cast<std::uint64_t>(track.width));
  add(video, kPixelHeight, static_cast<std::uint64_t>(track.height));
  if (track.codec == "V_UNCOMPRESSED") {
    add(video, kUncompressedFourCc, Bytes(track.uncompressed_fourcc.begin(), track.uncompressed_fourcc.end()));
  }
  Bytes entry;
  add(entry, kTrackNumber, 1);
  add(entry, kTrackUid, 1);
  add(entry, kTrackType, 1);  // video
  add(entry, kFlagLacing, 0);
  add(entry, kMaxBlockAdditionId, MatroskaFile::kExposureId);
  add(entry, kCodecId, track.codec);
  if (!track.codec_private.empty()) add(entry, kCodecPrivate, track.codec_private);
  add(entry, kVideo, video);
  Bytes tracks;
  add(tracks, kTrackEntry, entry);

  Bytes out;
  add(out, kEbml, ebml);
  add_id(out, kSegment);
  add_big_endian(out, 0x01FFFFFFFFFFFFFF, 8);  // unknown length: up to the end of the file
  add(out, kInfo, info);
  add(out, kTracks, tracks);
  return out;
}

}  // namespace

MatroskaFile::MatroskaFile(const std::filesystem::path& file, const MatroskaTrack& track)
    : file_(file), descriptor_(open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (descriptor_.number() < 0) throw std::runtime_error(file.string() + ": " + std::generic_category().message(errno));
  write({file_header(track)});
}

void MatroskaFile::append(std::int64_t time_ns, std::span<const std::uint8_t> frame, std::optional<double> exposure) {
  Bytes after;  // elements that follow the frame in its group
  if (exposure) {
    Bytes number, more, additions;
    add_big_endian(number, std::bit_cast<std::uint64_t>(*exposure), 8);
    add(more, kBlockAddId, kExposureId);
    add(more, kBlockAdditional, number);
    add(additions, kBlockMore, more);
    add(after, kBlockAdditions, additions);
  }
  Bytes timestamp;
  add(timestamp, kTimestamp, static_cast<std::uint64_t>(time_ns));
  constexpr std::uint64_t kBlockHead = 4;        // track number, two bytes of time relative to the cluster, flags
  constexpr std::uint64_t kElementHead = 1 + 8;  // of kBlock and kBlockGroup: ID and size
  const std::uint64_t block = kBlockHead + frame.size();
  const std::uint64_t group = kElementHead + block + after.size();
  Bytes head;
  add_id(head, kCluster);
  add_size(head, timestamp.size() + kElementHead + group);
  head.insert(head.end(), timestamp.begin(), timestamp.end());
  add_id(head, kBlockGroup);
  add_size(head, group);
  add_id(head, kBlock);
  add_size(head, block);
  add_big_endian(head, 0x81000000, kBlockHead);
  write({head, frame, after});
}

/// Writes all pieces; if that fails, cuts the file back to its length before the call.
void MatroskaFile::write(const std::vector<std::span<const std::uint8_t>>& pieces) {
  std::vector<iovec> left;
  std::int64_t size = 0;
  for (const auto& piece : pieces) {
    left.push_back({const_cast<std::uint8_t*>(piece.data()), piece.size()});
    size += static_cast<std::int64_t>(piece.size());
  }
  for (std::int64_t done = 0; done < size;) {
    const ssize_t written = writev(descriptor_.number(), left.data(), static_cast<int>(left.size()));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int why = written < 0 ? errno : ENOSPC;
      // Readers accept an incomplete end too, for programs that are killed; where possible it is removed.
      if (ftruncate(descriptor_.number(), length_) == 0) lseek(descriptor_.number(), length_, SEEK_SET);
      throw std::runtime_error(file_.string() + ": " + std::generic_category().message(why));
    }
    done += written;
    auto rest = static_cast<std::size_t>(written);
    for (iovec& piece : left) {
      const std::size_t taken = std::min(rest, piece.iov_len);
      piece.iov_base = static_cast<std::uint8_t*>(piece.iov_base) + taken;
      piece.iov_len -= taken;
      rest -= taken;
    }
  }
  length_ += size;
}

}  // namespace lumigraft::capture
