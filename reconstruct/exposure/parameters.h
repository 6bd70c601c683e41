#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept.
#include <cstddef>

namespace lumigraft::reconstruct {

struct ExposureParameters {
  float cell_m = 0.02f;              ///< edge of a cell of surface, for which one radiance is stored
  std::size_t max_cells = 20'000;    ///< beyond it those seen longest ago are dropped: 3 MB
  std::size_t min_matches = 40;      ///< cells that are seen again, for a gain to be determined
  int min_code = 16;                 ///< rounding changes the light of darker pixel values by more than 4 %
  float texture_log_sigma = 0.05f;   ///< 1σ of a cell's log radiance between views: texture, gloss, pose
  float max_light_change = 4;        ///< ratio of irradiance, then and now, up to which a cell's radiance is predicted
  float inlier_log = 0.15f;          ///< deviation of a cell from the common gain that explains it
  float min_inlier_fraction = 0.5f;  ///< of the matches: with fewer, light changed in a way the fish-eye did not show
  float independent_matches = 10;    ///< matches per independent one, as neighbours share their errors
  float min_log_step = 0.01f;        ///< a smaller change is not followed: less than one step of 8-bit pixel values
  float step_sigmas = 2;             ///< nor is one below so many σ of the median
  float max_hidden_error = 1;        ///< log error of a place at most, when a hidden lamp is tried: other things moved
  int max_average = 16;              ///< observations over which a cell's radiance averages
  int replaced_after = 8;            ///< observations in a row that contradict a cell until it is learnt anew
  float warning_log = 0.1f;          ///< mean log gain beyond which a warning reports it
  float hue_warning_log = 0.05f;     ///< the same for the deviation of a channel from the mean
};
inline constexpr ExposureParameters kExposure;

}  // namespace lumigraft::reconstruct
