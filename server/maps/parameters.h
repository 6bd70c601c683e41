#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <chrono>

namespace lumigraft::server {
inline constexpr struct MapParameters {
  /// Between two maps of a kind; how long one is drawn after it was asked for.
  std::chrono::milliseconds apart{200}, asked_for{3000};
  int pixels_apart = 2;             ///< of the picture, between two rays of depth, surface and albedo
  float near_m = 0.1f, far_m = 12;  ///< of those rays
  /// Colours of depth span this range; logarithmic, as the error of depth grows with it.
  float first_depth_m = 0.3f, last_depth_m = 8;
  float change_gain = 2;         ///< pixel values around mid grey per pixel value of change
  float behind_lamps = 0.35f;    ///< brightness of the camera's picture under the marks of lamps
  double arrow_fraction = 0.04;  ///< of the picture's height: marks of lamps outside it
  int jpeg_quality = 90;
} kMaps;
}  // namespace lumigraft::server
