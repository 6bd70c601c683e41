#pragma once
// Version 1 of the protocol by which a helper program gives frames, described for other programs in docs/helpers.md.
// It writes to a pipe: `unavailable` or `refused`, or `opened` and then `frame` and `lost`.
#include <array>
#include <cstdint>

namespace lumigraft::capture {

inline constexpr int kHelperPipe = 3;  ///< descriptor in the helper
inline constexpr std::array<char, 4> kHelperMark = {'L', 'G', 'H', '1'};

/// Followed by `bytes` bytes: the pixels of a frame, the serial number of what was opened, or the reason of others.
struct HelperMessage {
  enum class Kind : std::uint32_t { unavailable, refused, opened, frame, lost };

  std::array<char, 4> mark = kHelperMark;
  Kind kind = Kind::unavailable;
  std::uint32_t stream = 0;    ///< frame, lost: index into the requested streams
  std::uint32_t bytes = 0;     ///< that follow
  std::int64_t time_ns = 0;    ///< frame, lost
  std::uint64_t sequence = 0;  ///< frame, lost
  double exposure_us = 0.0;    ///< frame, if the camera reports it, else 0
  double gain = 0.0;           ///< as exposure_us
};
static_assert(sizeof(HelperMessage) == 48);

}  // namespace lumigraft::capture
