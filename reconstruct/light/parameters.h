#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept. Measured: tests/bench/results/sweeps (light-*), tests/bench/results/real_data.md.
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace lumigraft::reconstruct {

constexpr float kDegree = std::numbers::pi_v<float> / 180;  ///< in radians

struct LightParameters {
  int max_lights = 64;  ///< strongest first; bounds the time of one image: about 0.3 ms a lamp

  struct Environment {
    int width = 128, height = 64;   ///< cells: 2.8°, far finer than nine harmonics or a diffuse surface resolve
    int subsamples = 6;             ///< per edge of a cell, which has about 8 x 8 pixels of a 512-pixel fish-eye
    float fill_margin_rad = 0.12f;  ///< an unseen cell takes the mean of cells up to this farther than the nearest
  } environment;

  struct Regions {
    float max_region_sr = 0.8f;  ///< a larger region is not compact
    float max_growth = 0.3f;     ///< of the solid angle over one octave of threshold, blurred edge excepted
    int thresholds_per_octave = 4;
  } regions;

  struct Split {
    int max_other_peaks = 64;            ///< that are no lamps: bounds the time of one image
    int edge_px = 2;                     ///< how far the blurred border of a lamp reaches beyond its outline
    int surround_px = 5;                 ///< the ring from edge_px to here measures the background
    float floor_over_median = 1.5f;      ///< radiance over the image's median, below which no lamp is searched
    float min_over_white = 2;            ///< radiance of a lamp over that of a white surface at the probe, flux / π
    float min_contrast = 4.0f;           ///< mean radiance of a lamp over its background
    float min_clipped_contrast = 1.15f;  ///< the same where the radiance is a lower bound
    float min_small_contrast = 1.5f;     ///< the same for a clipped region of fewer than min_clipped_px
    float max_extent_rad = 0.35f;        ///< RMS extent of a lamp; a disk's is its radius / √2
    float max_piece_extent_rad = 0.16f;  ///< RMS extent beyond which one lamp is cut into several
    float min_energy_fraction = 0.01f;   ///< of the lamps' energy, and half of it of the image's
    float min_white_ratio = 0.99f;       ///< smallest over largest channel of a clipped pixel: all channels are clipped
    /// Smallest over largest channel of a clipped pixel, below which the smallest is measured: full scale is 250 of
    /// 255, 0.956 in linear light.
    float max_measured_ratio = 0.95f;
    double min_connected_fraction = 0.9;  ///< of a glow's energy in one connected part of it, to be one region
    std::size_t min_clipped_px = 5;
    std::size_t min_white_px = 2;  ///< where all channels clip: the sun is hardly wider than a pixel
    double min_filled = 0.6;       ///< of a clipped region, over the rectangle of its moments: tubes and panels have 1,
    double max_outline_ratio = 2;  ///< and its outline over the rectangle's: slanting 10 : 1 rectangles have 1.3
    double edge_ratio = 0.8;       ///< a pixel of the ring below this fraction of the region's mean is darker,
    std::ptrdiff_t min_darker_tenths = 7;  ///< and so many tenths of the ring must be: a lit surface fades gradually
    std::size_t max_view_end_tenths = 1;   ///< of a clipped region's pixels at the end of the view
    double glow_over_mean = 4;             ///< residual radiance above this multiple of its mean is a glow,
    double min_glow_fraction = 0.2;        ///< which is cut into lamps if it has this fraction of the image's energy
  } split;

  struct Merge {
    /// Distance of a piece on its lamp's plane over the lamp's, or inverse. Beyond it the piece is not on the plane.
    float max_plane_distance_ratio = 2;
  } merge;

  struct Tracking {
    float max_lamp_angle_rad = 0.1f;  ///< between frames, for lamps without a tag
    /// A lamp that is carried past the fish-eye at arm's length turns by this between frames at 10 Hz; it is recognized
    /// by its power, which changes with its distance, and its hue.
    float max_carried_angle_rad = 0.5f, max_carried_ratio = 2, max_carried_hue = 0.1f;
    float max_still_angle_rad = 0.009f;  ///< about 1.5 pixels of a 512-pixel fish-eye
    float max_still_change = 0.1f;       ///< relative, of a lamp's irradiance, and of the environment
    std::size_t max_remembered = 256;    ///< lamps whose direction is known when they are switched on again
    int max_averaged = 10;               ///< frames in the running mean: a third of a second of lag at 30 Hz
    double min_missing_fraction = 0.5;   ///< of a lamp's energy missing in the frame, for the lamp to count as covered
    int held_frames = 3, fade_frames = 4;  ///< of a covered lamp: steps of a quarter (sweep light-covered)

    /// A fixed lamp whose image is cut, not dimmed, is covered.
    struct Covered {
      int settled_images = 3;      ///< at one place with one size, until a lamp counts as fixed
      float min_fraction = 0.05f;  ///< of its solid angle: outlines are as uncertain
      float outline = 1.5f;        ///< its reach in angular radii: 1.4 of a 2:1 panel, and the edge
      float min_shift = 0.25f;     ///< of the centroid, over the radius times the covered fraction; 0.8 if one side
                                   ///< of a disk is cut, 0 if it shrinks as of a lamp that is carried away
      float max_brighter = 1.15f;  ///< mean radiance over that of before: the rest of the lamp is as bright,
      float min_radiance = 0.5f;   ///< or darker where narrow parts are blurred
      float min_lit_fraction =
          2 / 3.0f;             ///< of the lamp's share of all light that the room still shows if it is covered
      float min_share = 0.05f;  ///< of all light, below which the room does not show whether a lamp shines
    } covered;
  } tracking;

  struct TagMatching {
    float fisheye_sigma_rad = 0.005f;  ///< 1σ of a lamp's direction in the image: lens and pose of the fish-eye
    /// 2°: the centroid of the energy is not exactly the lamp's centre.
    float slack_rad = 2 * std::numbers::pi_v<float> / 180;
    float gate_sigmas = 3;                 ///< of the tag's direction
    float gate_radii = 0.5f;               ///< of the lamp, seen from the probe
    float near_deg = 20;                   ///< a lamp this close to a dark tagged place is named in the warning
    float known_power_log_sigma = 0.1f;    ///< of a configured or formerly measured intensity
    float min_configured_ratio = 0.8f;     ///< configured over measured power of a clipped lamp; below, it is not used
    float unknown_power_fraction = 1e-3f;  ///< of all light at the probe: start power of a lamp never measured
    float view_margin_rad =
        std::numbers::pi_v<float> / 180;  ///< 1°: lamps at the end of the view are not measured well
    float min_distance_m = 0.05f;         ///< to the fish-eye; avoids division by zero
    float min_facing_cosine = 0.05f;      ///< below it a panel does not show its face to the fish-eye
    float same_position_m = 0.002f, same_irradiance = 0.01f, same_normal = 0.01f;  ///< noise of a still lamp's tag
  } tag_matching;

  struct Occlusion {
    int pixel_step = 7;             ///< of the colour image, in u and v; the median needs no more
    std::uint8_t min_code = 16;     ///< rounding changes the light of darker pixel values by more than 4 %
    double max_flux_ratio = 0.05;   ///< now over before: the fish-eye went dark
    float min_colour_ratio = 0.5f;  ///< now over before: the colour camera still sees a lit room
    double max_returned_ratio = 5;  ///< radiosity over irradiance. Above 1 where surfaces are nearer to a lamp
  } occlusion;

  struct ExtrinsicsCheck {
    int directions = 5000;            ///< over the sphere
    std::size_t min_directions = 16;  ///< that both cameras must have measured
    float max_ray_m = 10;
    float margin_deg = 4;             ///< at the end of the view and around lamps: a cell of the environment
    float max_log_difference = 0.5f;  ///< of radiance; larger ones count as this (a robust L1 cost)
    float agreement = 0.025f;  ///< mean log difference: 0.005 to 0.012 for six correct rigs, from 0.036 if turned by 8°
    float cell_rad = 0.05f;    ///< of the environment: a direction counts if all within it are known, and
    float max_unevenness = 0.2f;           ///< log radiance there differs by less
    float directions_per_observation = 2;  ///< they are as far apart as cells, between which radiance is interpolated
    float min_likelihood_ratio = 28;       ///< χ² of six degrees of freedom exceeds it once in 10⁴
    std::size_t starts = 3;                ///< of the refinement, so many turns,
    float start_separation_deg = 20;       ///< and so far apart
    float min_common_fraction = 0.6f;      ///< of the directions common to both at the configured pose
    float min_improvement = 0.5f;          ///< another pose's cost over the configured one's must be below this
    float shift_over_turn = 0.75f;         ///< a shift's cost over a turn's, for the shift to be the likelier error
    float min_turn_deg = 3, min_shift_m = 0.05f;      ///< smaller errors are within noise
    float first_turn_deg = 5, first_shift_m = 0.08f;  ///< first steps of the refinement,
    int refine_levels = 4, rounds_per_level = 4;      ///< which are halved from level to level
  } extrinsics_check;
};

inline constexpr LightParameters kLightParameters{};

}  // namespace lumigraft::reconstruct
