#pragma once
// Ranges of the numbers in session.toml. They catch wrong units and slips of the pen; real cameras lie well inside.
// All were chosen by hand.

namespace lumigraft::capture {

inline constexpr struct SessionLimits {
  double max_focal_length_px = 1e6;
  double min_exposure_us = 1.0, max_exposure_us = 60e6;  ///< of one frame of a live camera
  double max_gain = 1e6;  ///< magnitude; in the camera's unit, which may be decibels and negative
  double min_rate_hz = 0.01, max_rate_hz = 1000.0;
  double min_exposure = 1e-9, max_exposure = 1e9;  ///< of `exposure`: linear value per W/sr/m²
  double min_transmission = 0.02,
         max_transmission = 2.0;   ///< of vignetting anywhere in the field, relative to the axis
  double max_time_offset_s = 1.0;  ///< magnitude, between fish-eye and colour; real delays are a few frames
  double max_readout_ms = 1000.0;  ///< magnitude; of all rows of an image
  double min_tag_size_m = 0.001, max_tag_size_m = 10.0;  ///< edge of the black square
  double min_lamp_radius_m = 0.001, max_lamp_radius_m = 2.0;
  double min_noise_scale = 0.1, max_noise_scale = 10.0;  ///< of depth, relative to a usual camera of its principle
  double max_lamp_offset_m = 5.0;                        ///< magnitude per axis, from a lamp's tag to its centre
  double max_lamp_intensity_w_sr = 1e6;                  ///< per channel
} kSessionLimits;

}  // namespace lumigraft::capture
