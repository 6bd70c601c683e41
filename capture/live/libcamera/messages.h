#pragma once
// Messages between lumigraft_libcamera, the helper program that runs libcamera, and LibcameraSource, over a socket that
// preserves message boundaries. libcamera 0.0.3 aborts its process when a camera is unplugged, hence the helper.
//
// The helper first sends `unavailable`, `unfit`, or `opened`; then for every buffer `memory`, with the descriptors of
// its planes (dma-buf) attached, and then frames. LibcameraSource returns a buffer by sending its index as 32 bits.
#include <array>
#include <cstdint>

#include "capture/formats/pixel_format.h"
#include "capture/live/reported_exposure.h"

namespace lumigraft::capture::libcam {

inline constexpr int kHelperSocket = 3;  ///< descriptor in the helper
inline constexpr std::size_t kMaxPlanes = 3;

struct HelperMessage {
  enum class Kind { unavailable, unfit, opened, memory, frame };
  struct Plane {
    std::uint32_t offset, length;  ///< in the plane's descriptor, bytes
  };

  Kind kind = Kind::unavailable;
  std::array<char, 256> text{};                  ///< unavailable, unfit: why; opened: serial number
  PixelFormat format = PixelFormat::rgb8;        ///< opened
  std::uint32_t stride = 0;                      ///< opened; bytes
  std::uint32_t buffers = 0;                     ///< opened
  std::uint32_t index = 0;                       ///< memory, picture: index of the buffer
  std::uint32_t planes = 0;                      ///< memory
  std::array<Plane, kMaxPlanes> plane{};         ///< memory
  std::array<std::uint32_t, kMaxPlanes> used{};  ///< picture; bytes
  bool complete = false;                         ///< picture
  std::int64_t time_ns = 0;                      ///< picture: sensor time
  std::uint32_t sequence = 0;                    ///< picture: the driver's number
  ReportedSettings reported{};                   ///< picture
};

}  // namespace lumigraft::capture::libcam
