#pragma once
// The kernel's virtual camera vivid, and control of it by a test while it is in use.
#include <array>
#include <cstdint>
#include <string>

#include "capture/session/stream_spec.h"

namespace lumigraft::test {

inline constexpr char kSinglePlanar[] = "platform:vivid-000";  ///< bus names, since node numbers may change
inline constexpr char kMultiPlanar[] = "platform:vivid-001";
inline constexpr char kGrabber[] = "platform:vivid-002";  ///< has inputs "Webcam 0" and "HDMI 0"
inline constexpr int kVividWidth = 320;
inline constexpr int kVividHeight = 180;

/// Bars of 75 % (ITU-R BT.471) that vivid and vimc show.
inline constexpr int k75 = 191;
inline constexpr std::array<std::array<int, 3>, 8> kBars = {
    {{k75, k75, k75}, {k75, k75, 0}, {0, k75, k75}, {0, k75, 0}, {k75, 0, k75}, {k75, 0, 0}, {0, 0, k75}, {0, 0, 0}}};

/// The camera without text overlay: eight bars of full height.
capture::StreamSpec vivid_spec(capture::PixelFormat format);

/// A second handle of the camera, which changes its controls.
class Vivid {
 public:
  explicit Vivid(const std::string& bus = kSinglePlanar);
  ~Vivid();
  Vivid(const Vivid&) = delete;
  Vivid& operator=(const Vivid&) = delete;

  bool open() const { return descriptor_ >= 0; }
  /// Sets a control by the driver's name. False if the driver refuses.
  bool set(const std::string& control, std::int64_t value = 1) const;
  /// Sets a menu control to the entry of that name.
  bool choose(const std::string& control, const std::string& entry) const;
  bool choose_input(const std::string& input) const;

 private:
  int descriptor_ = -1;
};

}  // namespace lumigraft::test
