#pragma once
// Reads and sets controls of a V4L2 camera by name. Included by .cpp files alone.
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/live/v4l2/device.h"
#include "capture/session/camera_settings.h"

namespace lumigraft::capture::v4l2 {

struct Control {
  std::uint32_t id = 0;
  std::string name;  ///< as in v4l2-ctl: "White Balance, Auto" is white_balance_auto
  std::int64_t low = 0, high = 0;
  bool read_only = false;
};

/// Controls with one number as value.
std::vector<Control> controls(const Device& device);
/// Throws as fail() does.
std::int64_t value_of(const Device& device, const Control& control);

/// Switches auto-exposure, auto-gain and automatic white balance off (of a depth camera only what `exposure_us` needs),
/// then sets exposure, gain and named controls.
/// Returns the exposure that the driver set, which may be rounded; empty if the settings state none. Throws InputError
/// for what the camera does not offer, except automatic functions of the colour camera.
std::optional<double> set_controls(const Device& device, capture::Stream stream, const CameraSettings& settings);
/// Whether a colour camera may adapt to the light before set_controls's automatic functions are off for good: it has
/// some, and the settings state none of what they change.
bool may_adapt(const Device& device, capture::Stream stream, const CameraSettings& settings);
/// Values of exposure, gain and white balance, in the order of controls().
using AdaptedValues = std::vector<std::int64_t>;
/// Switches automatic exposure, gain and white balance on. A camera that does not take it keeps what it has. Returns
/// the values before.
AdaptedValues let_adapt(const Device& device);
/// Switches them off again. Sets the values that have changed since, as some cameras then return to earlier ones, and
/// returns them by the names of a configuration; a camera that does not report what it does shows no change.
std::string hold(const Device& device, const AdaptedValues& before);

/// Returns the exposure that the driver set, which may be rounded. Throws InputError.
double set_exposure_us(const Device& device, double exposure_us);

/// Unit of V4L2_CID_EXPOSURE_ABSOLUTE.
inline constexpr double kExposureUnit_us = 100.0;

}  // namespace lumigraft::capture::v4l2
