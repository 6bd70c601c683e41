#pragma once
// The pictures of a live fish-eye by themselves, as they come: what light falls into the room does not depend on
// whether the colour camera sees anything. Recordings need none of this: there the fish-eye comes paired with colour
// (pairing_reader.h), so that the same files always give the same frames.
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
  /// `offset_ns` is added to the times of its pictures.
  FisheyeReader(std::shared_ptr<Source> source, std::int64_t offset_ns);

  struct Result {
    FisheyePictures pictures;           ///< of one time; empty where all that came was lost
    std::vector<std::string> warnings;  ///< what is missing, lost or out of order before them
  };
  /// The newest that are there, else the next that come. Empty: timeout.
  std::optional<Result> next(std::chrono::milliseconds timeout);
  /// What keeps the camera from giving pictures; empty where nothing does.
  std::string fault() const { return source_->fault(); }

 private:
  bool pull(std::chrono::milliseconds timeout);

  std::shared_ptr<Source> source_;
  StreamLane lane_;
};

/// Takes the fish-eye out of `sources` and reads it by itself. Null where there is none, and for recordings, of which
/// it stays with the others.
std::unique_ptr<FisheyeReader> read_fisheye_apart(PairedSources& sources);

}  // namespace lumigraft::capture
