#pragma once
// Plugs in the camera of usb_camera.cpp for the lifetime of an object.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "capture/error.h"
#include "capture/live/v4l2/device.h"
#include "capture/session/stream_spec.h"
#include "tests/capture/child_process.h"

namespace lumigraft::test {

class UsbPlug {
 public:
  static constexpr char kName[] = "Test Camera";
  static constexpr int kWidth = 160;
  static constexpr int kHeight = 120;

  /// Returns when `found` is true: the system has the camera.
  explicit UsbPlug(const std::function<bool()>& found = known_to_the_kernel, const std::vector<std::string>& more = {})
      : process_(command(more)) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    while (process_.running() && !found() && Clock::now() - begin < std::chrono::seconds(20)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_TRUE(process_.running() && found());
  }
  /// Checks without USB requests: gadgetfs would mix them up with those of a source that opens the camera meanwhile.
  static bool known_to_the_kernel() {
    for (const std::string& node : capture::v4l2::nodes()) {
      try {
        if (capture::v4l2::Device(node).card().rfind(kName, 0) == 0) {
          return true;
        }
      } catch (const capture::InputError&) {  // the node has disappeared again
      }
    }
    return false;
  }
  void signal(int number) const { process_.signal(number); }

 private:
  static std::vector<std::string> command(const std::vector<std::string>& more) {
    std::vector<std::string> out = {LUMIGRAFT_USB_CAMERA, std::to_string(kWidth), std::to_string(kHeight), "20"};
    out.insert(out.end(), more.begin(), more.end());
    return out;
  }
  ChildProcess process_;
};

inline capture::StreamSpec usb_spec(double exposure_us) {
  capture::StreamSpec spec{
      .stream = capture::Stream::fisheye, .width = UsbPlug::kWidth, .height = UsbPlug::kHeight, .exposure = 2.0};
  spec.settings.exposure_us = exposure_us;
  return spec;
}

}  // namespace lumigraft::test
