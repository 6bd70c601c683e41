#pragma once
// What lumigraft_libcamera, the program that libcamera runs in, and LibcameraSource tell each other over a socket that
// keeps messages whole. libcamera 0.0.3 aborts its process when a camera is unplugged, so it gets one of its own.
//
// The helper first says `unavailable`, `unfit`, or `opened`; then for every buffer `memory`, with the descriptors of
// its planes (dma-buf) beside it, and then pictures. An index comes back, as 32 bits, when its buffer may be filled
// again.
#include <array>
#include <cstdint>

#include "capture/formats/pixel_format.h"

namespace lumigraft::capture::libcam {

inline constexpr int kHelperSocket = 3;  ///< its descriptor in the helper
inline constexpr std::size_t kMostPlanes = 3;

struct HelperMessage {
  enum class Kind { unavailable, unfit, opened, memory, picture };
  struct Plane {
    std::uint32_t offset, length;  ///< in its own descriptor, bytes
  };

  Kind kind = Kind::unavailable;
  std::array<char, 256> text{};                   ///< unavailable, unfit: why; opened: its serial number
  PixelFormat format = PixelFormat::rgb8;         ///< opened
  std::uint32_t stride = 0;                       ///< opened; bytes
  std::uint32_t buffers = 0;                      ///< opened
  std::uint32_t index = 0;                        ///< memory, picture: of the buffer
  std::uint32_t planes = 0;                       ///< memory
  std::array<Plane, kMostPlanes> plane{};         ///< memory
  std::array<std::uint32_t, kMostPlanes> used{};  ///< picture; bytes
  bool whole = false;                             ///< picture
  std::int64_t time_ns = 0;                       ///< picture: of the sensor
  std::uint32_t sequence = 0;                     ///< picture: the driver's number
  double exposure = 1.0;                          ///< picture
};

}  // namespace lumigraft::capture::libcam
