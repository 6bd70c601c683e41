#pragma once
// Settings of a live camera. In a recording's session file they document how it was recorded.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/formats/pixel_format.h"

namespace lumigraft::capture {

struct CameraSettings {
  std::optional<PixelFormat> pixel_format;  ///< empty: a colour format if the camera offers one
  std::optional<std::string> input;         ///< v4l2: name of a frame grabber's input; empty: the selected one
  std::optional<double> rate_hz;
  std::optional<double> exposure_us;  ///< auto-exposure is off: radiance needs a fixed or reported exposure
  std::optional<double> gain;
  std::vector<double> bracket_us;                        ///< fish-eye: exposures taken in turn; requires exposure_us
  std::vector<std::pair<std::string, double>> controls;  ///< further controls by the camera's own names
};

}  // namespace lumigraft::capture
