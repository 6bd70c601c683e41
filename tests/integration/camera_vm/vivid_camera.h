#pragma once
// The kernel's virtual camera, and how a test plays tricks on it behind the back of what is tested.
#include <cstdint>
#include <string>

#include "capture/session/stream_spec.h"

namespace lumigraft::test {

inline constexpr char kSinglePlanar[] = "platform:vivid-000";  ///< the bus: nodes may be numbered anew
inline constexpr char kMultiPlanar[] = "platform:vivid-001";
inline constexpr char kGrabber[] = "platform:vivid-002";  ///< has inputs "Webcam 0" and "HDMI 0"
inline constexpr int kVividWidth = 320;
inline constexpr int kVividHeight = 180;

/// The camera with its text switched off: eight bars of full height.
capture::StreamSpec vivid_spec(capture::PixelFormat format);

/// A second hand on the camera.
class Vivid {
 public:
  explicit Vivid(const std::string& bus = kSinglePlanar);
  ~Vivid();
  Vivid(const Vivid&) = delete;
  Vivid& operator=(const Vivid&) = delete;

  bool open() const { return descriptor_ >= 0; }
  /// By the driver's own name. False where the driver refuses.
  bool set(const std::string& control, std::int64_t value = 1) const;
  /// Of a control that is a menu, the entry of that name.
  bool choose(const std::string& control, const std::string& entry) const;
  bool choose_input(const std::string& input) const;

 private:
  int descriptor_ = -1;
};

}  // namespace lumigraft::test
