#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept.
#include <cstddef>
#include <cstdint>

#include "reconstruct/light/parameters.h"

namespace lumigraft::reconstruct {

struct ExposureParameters {
  float cell_m = 0.02f;            ///< edge of a cell of surface, for which one radiance is stored
  std::size_t max_cells = 20'000;  ///< beyond it those seen longest ago are dropped: 3 MB
  std::size_t min_matches = 40;    ///< cells that are seen again, for a gain to be determined
  std::uint8_t min_code = kLightParameters.occlusion.min_code;
  float texture_log_sigma = 0.05f;   ///< 1σ of a cell's log radiance between views: texture, gloss, pose
  float max_light_change = 4;        ///< ratio of irradiance, then and now, up to which a cell's radiance is predicted
  float inlier_log = 0.15f;          ///< deviation of a cell from the common gain that explains it
  float min_inlier_fraction = 0.5f;  ///< of the matches: with fewer, light changed in a way the fish-eye did not show
  float independent_matches = 10;    ///< matches per independent one, as neighbours share their errors
  float min_log_step = 0.01f;        ///< a smaller change is not followed: less than one step of 8-bit pixel values
  float step_sigmas = 2;             ///< nor is one below so many σ of the median
  /// By which another gain must explain a frame better when a hidden lamp is tried: more than `step_sigmas`, so that
  /// the gain stays where both explain it.
  float other_gain_sigmas = 4;
  float max_hidden_error = 1;      ///< log error of a place at most, when a hidden lamp is tried: other things moved
  int max_average = 16;            ///< observations over which a cell's radiance averages
  float max_dark_fraction = 0.9f;  ///< of the places
  double same_light = 0.01;        ///< relative change of light below which what places show is not due to it
  std::int64_t stale_light_ns = 500'000'000;  ///< age of the fish-eye's frame: twice the difference of paired times
  float same_place_rad = 0.02f;               ///< a lamp whose direction changes by less did not move: 2 cm at 1 m
  int dimming_rounds = 20;                    ///< of the fit of powers, and of its solver in each
  int replaced_after = 8;                     ///< observations in a row that contradict a cell until it is learnt anew
  /// In a row while it is darker than it was, by no more than lamps give it: a shadow passes.
  int shadow_replaced_after = 300;
  float near_gain_log = 0.06f;  ///< deviation from the last gain of places that still agree with it: their texture
  int near_rounds = 10;         ///< of their median; one alone stays near the last gain when the gain changes slowly
  float min_near_fraction = 0.25f;  ///< of the matches: shadows cover the others, as another exposure changes all
  float warning_log = 0.1f;         ///< mean log gain beyond which a warning reports it
  float hue_warning_log = 0.05f;    ///< the same for the deviation of a channel from the mean

  /// Of what moved (observed_shadows.h).
  struct Shadows {
    int cells = 128;                  ///< along the edges of a lamp's map; a power of two
    float sigma = 0.05f;              ///< 1σ of a place's ratio: texture_log_sigma, that of all channels,
    float min_hue_sigma = 0.01f;      ///< and of each one's deviation from their mean at least; measured
    float min_darkening = 0.1f;       ///< of a place that is in a shadow
    float min_dark_fraction = 0.03f;  ///< of the places, for a shadow to be found
    float min_part = 0.02f;           ///< of a place's light, for a lamp to be known to light it
    /// Above a place's plane: other surface, which hides the lamp from it. Three times the noise of depth at 2 m.
    float min_above_m = 0.02f;
    int nearest_reach = 4;            ///< cells of a map of all places: where such surface is sought
    float outlier_fraction = 0.02f;   ///< at either end, of dark places that are no shadow
    float max_open = 0.8f;            ///< of a lamp at a place in its shadow,
    float min_weight = 0.5f;          ///< which has to be known: the lamp gives it sigma of its light
    std::size_t min_dark_places = 8;  ///< in the shadow of one lamp
    float margin = 0.15f;             ///< of a map around its shadow, and
    float upwards = 1;                ///< above it, times its size: no place may show where it ends
    float other_prior = 0.2f, covered_prior = 0.5f, rest_prior = 0.1f;  ///< w_k, w
    float moved_reach_m = 0.3f;                  ///< around what moved: what belongs to it and no camera sees
    float moved_cell_m = 0.1f;                   ///< edge of space that is remembered as filled
    std::int64_t moved_ns = 3'000'000'000;       ///< after which what moved belongs to the room
    std::size_t max_moved = 500;                 ///< points of what moved that are used
    std::int64_t max_gap_ns = 500'000'000;       ///< between frames: surface that appears after a longer one may be old
    std::int64_t forgotten_ns = 60'000'000'000;  ///< space that was not seen for so long is new
  } shadows;

  /// Against the fish-eye. Measured: ten path-traced rooms, gain within 1 %, and within 3 % of a wrong white balance.
  struct Match {
    std::uint64_t first = 8, every = 30;  ///< frames: each of the first, then one in so many, about one a second
    float min_level_log = 0.1f;           ///< a smaller common gain is not compensated: responses are as uncertain,
    float min_hue_log = 0.05f;            ///< nor a smaller deviation of a channel,
    float min_corner_log = 0.1f;          ///< nor a smaller loss in the corners
    float direction_rad = 0.05f;          ///< a cell of the environment
    float max_behind = 1.1f,
          max_behind_m = 0.05f;    ///< the nearest surface: what is farther is hidden from the fish-eye
    float lamp_margin_rad = 0.1f;  ///< lens flare and blur around a lamp
    float max_unevenness = 0.2f;   ///< log radiance of neighbouring cells
    float min_distance_m = 0.3f;   ///< to the fish-eye: nearer, its position error turns the direction
    std::size_t min_places = 40;
    float min_inliers = 0.5f;     ///< fraction of the places; with fewer T_tag_fisheye or the room are not as supposed
    float log_sigma = 0.1f;       ///< 1σ of a place's log ratio at most: gloss, cells of the environment, pose
    float min_log_sigma = 0.03f;  ///< at least: rounding of dark pixel values. Between them, the median error
    float places_per_observation = 30;            ///< neighbours share their errors
    float first_scale = 0.3f, scale_step = 0.8f;  ///< of the loss; it ends at log_sigma
    int rounds = 30;
    float gain_sigma = 0.5f;  ///< 1σ of the prior of log gain
    /// 1σ of the priors of k₁ and k₂. Natural vignetting (cos⁴ θ) in the corners of a 60° image is 0.58.
    float falloff_sigma = 0.5f, falloff_bend_sigma = 0.25f;
  } match;
};
inline constexpr ExposureParameters kExposure;

}  // namespace lumigraft::reconstruct
