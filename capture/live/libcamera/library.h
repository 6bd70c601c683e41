#pragma once
// What both users of libcamera need: its cameras and its words. Included by .cpp files alone.
#include <libcamera/libcamera.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/formats/pixel_format.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::libcam {

/// Those that are plugged in now. Throws CameraFault.
std::vector<std::shared_ptr<libcamera::Camera>> cameras();
/// The one that reads from this node of the kernel; null where none does.
std::shared_ptr<libcamera::Camera> camera_of_node(dev_t node);

/// What the maker calls it; empty where nobody says.
std::string model_of(const libcamera::Camera& camera);

std::optional<PixelFormat> pixel_format_of(const libcamera::PixelFormat& format);
std::optional<libcamera::PixelFormat> libcamera_format_of(PixelFormat format);

/// Of its kinds of streams those that we take: for pictures, and the sensor's own Bayer.
inline constexpr libcamera::StreamRole kRoles[] = {libcamera::StreamRole::VideoRecording, libcamera::StreamRole::Raw};

/// White balance, the one control of several numbers that a session may set, as `controls` name its two.
inline constexpr const char* kRedGain = "ColourGains[Red]";
inline constexpr const char* kBlueGain = "ColourGains[Blue]";
/// Controls that hold several numbers, though their bounds are of one.
bool holds_several(const libcamera::ControlId& control);

/// A control that holds one number; empty where it holds something else.
std::optional<double> number_in(const libcamera::ControlValue& value);
/// Throws InputError under the key that it was given as, where the camera has no such control or another range.
void set_number(libcamera::ControlList& list, const libcamera::ControlInfoMap& offered, const std::string& name,
                const std::string& key, double number);

/// Auto-exposure and automatic white balance off where there are any, and what the settings name. Throws InputError.
libcamera::ControlList controls_for(const libcamera::ControlInfoMap& offered, const CameraSettings& settings);

/// What a picture was really exposed with, by its own metadata, where the camera gives any: StreamSpec::exposure holds
/// for `exposure_us` and `gain`.
double exposure_of(const libcamera::ControlList& metadata, const StreamSpec& spec);

}  // namespace lumigraft::capture::libcam
