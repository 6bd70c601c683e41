#pragma once
// What a frame grabber looks at: its inputs, and what is plugged into a digital one. Included by .cpp files alone.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/v4l2/device.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::v4l2 {

struct Input {
  std::uint32_t index = 0;  ///< the driver's
  std::string name;         ///< the driver's, as "HDMI 0"
  bool digital = false;     ///< HDMI, DVI, SDI: its signal says size and rate itself
};

/// In the driver's order. Webcams have one, a driver without any gives none.
std::vector<Input> inputs(const Device& device);
/// The one that the camera looks at now.
std::optional<Input> chosen_input(const Device& device);
/// Of what is plugged into the chosen one, as "1280x720 at 60 Hz"; else what it lacks. Empty where it is not digital.
std::string signal_text(const Device& device);

/// Chooses the session's input by its name, or stays where the camera is, and follows a digital signal to its size and
/// rate. To be done before the format is agreed on, which hangs on it. Throws InputError for an input that is not
/// offered and for a signal of another shape than the session's pictures, CameraFault where there is none that can be
/// taken.
void choose_input(const Device& device, const StreamSpec& spec);

}  // namespace lumigraft::capture::v4l2
