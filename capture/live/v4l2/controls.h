#pragma once
// Controls of a V4L2 camera, by name. Included by .cpp files alone.
#include <string>
#include <vector>

#include "capture/live/v4l2/device.h"
#include "capture/session/camera_settings.h"

namespace lumigraft::capture::v4l2 {

struct Control {
  std::uint32_t id = 0;
  std::string name;  ///< the driver's, as v4l2-ctl writes it: "White Balance, Auto" is white_balance_auto
  std::int64_t low = 0;
  std::int64_t high = 0;
  bool read_only = false;
};

/// Those that hold one number.
std::vector<Control> controls(const Device& device);
/// Throws as fail() does.
std::int64_t value_of(const Device& device, const Control& control);

/// Auto-exposure, auto-gain and automatic white balance off, then exposure, gain and what the settings name. Throws
/// InputError for what the camera does not offer.
void set_controls(const Device& device, const CameraSettings& settings);
/// Throws InputError. Returns what the camera made of it, for it may round.
double set_exposure_us(const Device& device, double exposure_us);

/// V4L2_CID_EXPOSURE_ABSOLUTE counts these.
inline constexpr double kExposureUnit_us = 100.0;

}  // namespace lumigraft::capture::v4l2
