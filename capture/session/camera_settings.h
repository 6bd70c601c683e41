#pragma once
// How a live camera is to be run. What a recording carries of it says how it was.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/formats/pixel_format.h"

namespace lumigraft::capture {

struct CameraSettings {
  std::optional<PixelFormat> pixel_format;  ///< empty: a colour format where the camera offers one
  std::optional<std::string> input;         ///< v4l2: of a frame grabber, by its name; empty: the one that is chosen
  std::optional<double> rate_hz;
  std::optional<double> exposure_us;  ///< auto-exposure is off in any case: radiance needs a fixed one
  std::optional<double> gain;
  std::vector<double> bracket_us;  ///< of a fish-eye: exposures taken in turn; goes with exposure_us
  std::vector<std::pair<std::string, double>> controls;  ///< further ones, by the camera's own names
};

}  // namespace lumigraft::capture
