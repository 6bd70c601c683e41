#pragma once
// Inputs of a frame grabber and the signal of digital ones. Included by .cpp files alone.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/v4l2/device.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::v4l2 {

struct Input {
  std::uint32_t index = 0;  ///< in the driver
  std::string name;         ///< from the driver, for example "HDMI 0"
  bool digital = false;     ///< HDMI, DVI, SDI: the signal determines size and rate
};

/// In the driver's order. Webcams have one input; some drivers report none.
std::vector<Input> inputs(const Device& device);
std::optional<Input> selected_input(const Device& device);
/// Signal of the selected input, for example "1280x720 at 60 Hz", or why there is none. Empty if it is not digital.
std::string signal_text(const Device& device);

/// Selects the session's input by name, or keeps the selected one, and sets size and rate of a digital signal. Must
/// come before negotiate_format(). Throws InputError for an unknown input and for a signal of another aspect ratio than
/// the session's frames, CameraFault if there is no usable signal.
void select_input(const Device& device, const StreamSpec& spec);

}  // namespace lumigraft::capture::v4l2
