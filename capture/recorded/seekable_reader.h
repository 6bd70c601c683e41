#pragma once
// FrameSets of a recording from a given time on, without decoding everything before it. They equal those of a replay
// from the beginning: pairing starts two seconds earlier, since it depends on recent frames.
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/source.h"
#include "capture/sync/pairing_reader.h"

namespace lumigraft::capture {

/// Times are relative to the first colour frame.
class SeekableReader : public FrameReader {
 public:
  /// The next frame is the first one at or after `from_ns`. rewind() returns to it too.
  virtual void seek(std::int64_t from_ns) = 0;
  /// Time of the last colour frame; empty if only reading the whole recording would show it.
  virtual std::optional<std::int64_t> length_ns() const = 0;
};

/// Of opened sources, none of them live.
std::unique_ptr<SeekableReader> seekable_frames(PairedSources sources);

/// Throws as open_paired_frames, and InputError for live cameras.
std::unique_ptr<FrameReader> open_frames_from(const Session& session, std::int64_t from_ns);

}  // namespace lumigraft::capture
