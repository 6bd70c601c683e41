#pragma once
// Frames of a live fish-eye camera, independent of the colour camera, so that light is updated even if the colour
// camera delivers nothing. In recordings the fish-eye is paired with colour instead (pairing_reader.h), so that the
// same files always give the same frames.
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/sync/pairing_reader.h"
#include "capture/sync/stream_lane.h"

namespace lumigraft::capture {

class FisheyeReader {
 public:
  /// `offset_ns` is added to the times of its frames.
  FisheyeReader(std::shared_ptr<Source> source, std::int64_t offset_ns);

  struct Result {
    FisheyeFrames frames;               ///< of one time; empty if all were lost
    std::vector<std::string> warnings;  ///< missing, lost and misordered frames before them
  };
  /// The newest frames that have arrived, else the next to arrive. Empty: timeout.
  std::optional<Result> next(std::chrono::milliseconds timeout);
  /// See Source::fault.
  std::string fault() const { return source_->fault(); }

 private:
  bool pull(std::chrono::milliseconds timeout);

  std::shared_ptr<Source> source_;
  StreamLane lane_;
};

/// Moves a live fish-eye from `sources` to a reader of its own. Null if there is none; that of a recording stays in
/// `sources`.
std::unique_ptr<FisheyeReader> read_fisheye_apart(PairedSources& sources);

}  // namespace lumigraft::capture
