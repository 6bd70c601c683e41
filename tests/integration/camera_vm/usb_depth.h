#pragma once
// What the depth camera of usb_camera.cpp measures.
#include <cstdint>
#include <vector>

namespace lumigraft::test {

/// Of the frame `number`, which the camera counts from 0 to 255 and which is also the first pixel: every value of both
/// bytes, with holes.
inline std::vector<std::uint16_t> depth_counts(int width, int height, int number) {
  std::vector<std::uint16_t> out;
  for (int i = 0; i < width * height; ++i) out.push_back(static_cast<std::uint16_t>(i % 7 == 3 ? 0 : 257 * i + number));
  out[0] = static_cast<std::uint16_t>(number);
  return out;
}

}  // namespace lumigraft::test
