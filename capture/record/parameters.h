#pragma once
// Numbers of the recorder. All were chosen by hand.
#include <cstddef>

namespace lumigraft::capture {

inline constexpr struct RecordParameters {
  std::size_t queue_frames = 64;  ///< per stream, waiting to be written: two seconds at 30 Hz for a disk that stalls
  int background_niceness = 10;   ///< of the writer threads while a live picture is rendered
  int compression_niceness = 19;  ///< of compressing depth after a recording: the lowest priority there is
} kRecordParameters;

}  // namespace lumigraft::capture
