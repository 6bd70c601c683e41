#pragma once
// libcamera's cameras, formats and controls. Included by .cpp files alone.
#include <libcamera/libcamera.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/formats/pixel_format.h"
#include "capture/live/reported_exposure.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::libcam {

/// Cameras that are connected now. Throws CameraFault.
std::vector<std::shared_ptr<libcamera::Camera>> cameras();
/// The camera of a device node; null if there is none.
std::shared_ptr<libcamera::Camera> camera_of_node(dev_t node);

/// Model name; empty if unknown.
std::string model_of(const libcamera::Camera& camera);

std::optional<PixelFormat> pixel_format_of(const libcamera::PixelFormat& format);
std::optional<libcamera::PixelFormat> libcamera_format_of(PixelFormat format);

/// Kinds of streams that are used: processed frames, and raw Bayer.
inline constexpr libcamera::StreamRole kRoles[] = {libcamera::StreamRole::VideoRecording, libcamera::StreamRole::Raw};

/// Names of the two white balance gains in `controls`. It is the only control with several numbers that can be set.
inline constexpr const char* kRedGain = "ColourGains[Red]";
inline constexpr const char* kBlueGain = "ColourGains[Blue]";
/// Whether a control's value is an array, which its bounds do not show.
bool is_array(const libcamera::ControlId& control);

/// Value of a control with one number; empty for other types.
std::optional<double> number_in(const libcamera::ControlValue& value);
/// Throws InputError with the session's `key` if the camera has no such control or another range.
void set_number(libcamera::ControlList& list, const libcamera::ControlInfoMap& offered, const std::string& name,
                const std::string& key, double number);

/// Switches auto-exposure and automatic white balance off and sets the controls in `settings`. Throws InputError.
libcamera::ControlList controls_for(const libcamera::ControlInfoMap& offered, const CameraSettings& settings);

/// Settings in a frame's metadata. The gain is that of the sensor times that of the image processor.
ReportedSettings reported_in(const libcamera::ControlList& metadata);

}  // namespace lumigraft::capture::libcam
