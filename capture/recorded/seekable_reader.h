#pragma once
// FrameSets of a recording from a moment on, without decoding what lies long before it. They are those of a replay from
// the beginning: pairing begins two seconds earlier, since it depends on the newest pictures.
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/source.h"
#include "capture/sync/pairing_reader.h"

namespace lumigraft::capture {

/// Moments count from the first colour picture on.
class SeekableReader : public FrameReader {
 public:
  /// The next frame is the first one that is not before this. Rewinding goes there too.
  virtual void seek(std::int64_t from_ns) = 0;
  /// Of the last colour picture; empty where only reading everything would tell.
  virtual std::optional<std::int64_t> length_ns() const = 0;
};

/// From its opened sources, none of them live.
std::unique_ptr<SeekableReader> seekable_frames(const Session& session, PairedSources sources);

/// Throws as open_frames, and InputError for live cameras.
std::unique_ptr<FrameReader> open_frames_from(const Session& session, std::int64_t from_ns);

}  // namespace lumigraft::capture
