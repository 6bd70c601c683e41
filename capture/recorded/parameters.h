#pragma once
// Times and limits of recordings. Chosen by hand.
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace lumigraft::capture {

inline constexpr struct RecordedParameters {
  std::size_t cached_images = 8;              ///< of image lists that name a file more than once: a bracket or two
  std::int64_t seek_lead_ns = 2'000'000'000;  ///< read before the wanted time, since pairing depends on recent frames
  unsigned oni_pause_s = 10;                  ///< the OpenNI2 helper ends itself if OpenNI2 takes longer for a frame
  std::chrono::milliseconds oni_timeout{20'000};            ///< for the helper's answer; longer than oni_pause_s
  std::uint64_t oni_memory_bytes = std::uint64_t{1} << 30;  ///< that a damaged recording may allocate in the helper
} kRecordedParameters;

}  // namespace lumigraft::capture
