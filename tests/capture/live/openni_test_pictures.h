#pragma once
// Frames of the test device of openni_test_driver.cpp, as functions of the frame index.
#include <cstdint>

namespace lumigraft::test {

#ifndef LUMIGRAFT_TEST_DEVICE_SCALE
#define LUMIGRAFT_TEST_DEVICE_SCALE 1
#endif
constexpr int kDeviceWidth = 160 * LUMIGRAFT_TEST_DEVICE_SCALE;
constexpr int kDeviceHeight = 120 * LUMIGRAFT_TEST_DEVICE_SCALE;
constexpr int kDeviceFps = 30;
constexpr bool kDeviceHurries = LUMIGRAFT_TEST_DEVICE_SCALE == 1;  ///< faster than kDeviceFps
constexpr int kDeviceMaxDepth = 10000;

constexpr std::int64_t device_time_us(int index) { return 1'000'000 + index * 33'333LL; }

/// Millimetres; 0 (no measurement) in the eight columns on the left.
constexpr std::uint16_t device_depth(int index, int x, int y) {
  return x < 8 ? std::uint16_t{0} : static_cast<std::uint16_t>(500 + 3 * x + 2 * y + (7 * index) % 100);
}

constexpr std::uint8_t device_color(int index, int x, int y, int channel) {
  return static_cast<std::uint8_t>(channel == 0 ? x : channel == 1 ? 2 * y : 5 * index);
}

}  // namespace lumigraft::test
