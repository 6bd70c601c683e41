#pragma once
// Messages that the helper program lumigraft_oni sends to OniSource through a pipe: `refused` or `opened`, then frames.
// A frame's pixels follow its message, row by row in the format of the session's stream.
#include <array>
#include <cstdint>

namespace lumigraft::capture {

inline constexpr int kOniPipe = 3;  ///< descriptor in the helper

struct OniMessage {
  enum class Kind : std::uint32_t { refused, opened, frame, lost };

  Kind kind = Kind::refused;
  std::uint32_t stream = 0;       ///< picture, lost: index into the requested streams
  std::int64_t time_ns = 0;       ///< picture, lost
  std::uint64_t sequence = 0;     ///< picture, lost
  std::array<char, 1024> text{};  ///< refused, lost: why
};

}  // namespace lumigraft::capture
