#pragma once
// What lumigraft_oni, the program that recordings of OpenNI2 are read in, tells OniSource over a pipe: `refused` or
// `opened`; then pictures, each with its pixels behind it, row by row as the session's stream has them.
#include <array>
#include <cstdint>

namespace lumigraft::capture {

inline constexpr int kOniPipe = 3;  ///< its descriptor in the program

struct OniMessage {
  enum class Kind : std::uint32_t { refused, opened, picture, lost };

  Kind kind = Kind::refused;
  std::uint32_t stream = 0;       ///< picture, lost: which of those that were asked for, from 0
  std::int64_t time_ns = 0;       ///< picture, lost
  std::uint64_t sequence = 0;     ///< picture, lost
  std::array<char, 1024> text{};  ///< refused, lost: why
};

}  // namespace lumigraft::capture
