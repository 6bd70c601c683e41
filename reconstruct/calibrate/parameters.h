#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept. Measured:
// tests/bench/results/calibration.md.
#include <cstddef>
#include <numbers>

namespace lumigraft::reconstruct {
inline constexpr struct CalibrationParameters {
  int min_views = 8, min_moments = 5;  ///< positions of the board for any estimate; seen by both cameras
  double min_size_m = 0.001, max_size_m = 10,
         min_spacing = 0.2;     ///< of a tag, so that it is in metres; over it: a cell
  double unmodelled_px = 0.02;  ///< 1σ of corners outside the fit's covariance: blur that is no box, ink that spreads
  int max_rows = 100, sigma_steps = 12;  ///< also columns; places along a picture's axes at which 1σ is evaluated
  struct Corners {
    double blur_hold = 0.04;  ///< weight of a blur of 1 px, of the contrast, where paper clips: as in pose_alignment
    double huber = 0.15, max_error = 0.25, min_blur_px = 0.5, max_blur_px = 4;  ///< of the contrast; the error is RMS
    double min_cosine = 0.2, far_px = 2, far_edges = 0.05;           ///< to the tag's middle; from the detection
    double settled = 1e-5, first_damping = 1e-4, max_damping = 1e6;  ///< of the error and the diagonal, relative
    std::size_t min_print_px = 100;                                  ///< for 13 unknowns
    int iterations = 30;
  } corners;
  struct ViewSelection {
    double min_interval_s = 0.1, max_gap_s = 0.5;  ///< for computing time; no motion is estimated across longer gaps
    double max_still_speed = 0.06, min_apart = 0.04,
           apart_step = 1.3;                             ///< picture widths per s; between positions; growth
    std::size_t max_path_views = 300, max_moments = 60;  ///< of 30 s; of all: bound memory and time
    int clipped_code = 250;              ///< as in radiance.cpp: pixel values from here on are lower bounds
    double max_clipped_fraction = 0.01;  ///< of a tag's pixels, for its paper to be measured
  } view_selection;
  struct InitialGuess {
    /// Focal length over the picture's longer side: pinholes with fields of view from 136° to 13°, fish-eyes with image
    /// circles from 0.5 to 3 picture widths. A view without a pose counts as max_error_px.
    double min_pinhole = 0.2, max_pinhole = 4.5, min_fisheye = 0.15, max_fisheye = 1, max_error_px = 100;
    std::size_t max_views = 12;  ///< those with the most points
    int focal_steps = 16;        ///< logarithmic: 23 % and 13 % apart
  } initial_guess;
  struct BundleAdjustment {
    int robust_rounds = 4, pose_iterations = 15, iterations = 60;
    double settled = 0.02, tolerance = 1e-9, min_pivot = 1e-14;  ///< changes of scale and cost; of the normal matrix
    double huber = 1.5, outlier = 4, min_px = 0.2;               ///< σ beyond the RMS; smaller errors are no outliers
  } bundle_adjustment;
  struct Coverage {  // cells of a pinhole's picture; of a fish-eye's rings, the last of which has at least min_ring
    int columns = 8, rows = 6, sectors = 12;
    double ring_rad = 10 * std::numbers::pi / 180, min_ring = 0.05;
  } coverage;
  struct Depth {
    double used_edge = 0.9, min_z_m = 0.05;  ///< of the board: depth at its rim mixes with the background
    double first_gate_m = 0.15, gate_medians = 10, min_gate_m = 0.02;  ///< distance from the board, which shrinks
    int max_rounds = 25;
    std::size_t min_view_px = 100;
    double max_view_px = 400, huber_sigmas = 2,
           settled = 1e-7;        ///< of a view: they share its error; of a step, rad and m
    double noise_per_m = 0.0015;  ///< 1σ over z², by triangulation (Khoshelham & Elberink 2012); ratios count
    double min_tilt_rad2 = 1e-4;  ///< squared tilt between boards: parallel ones leave three parameters undetermined
  } depth;
  struct TimeOffset {
    double max_gap_s = 0.25, cubic_sigma_s = 1e-4;  ///< between poses; 1σ of a hand's motion from a cubic, as time
    double max_search_s = 0.3, search_s = 0.01, huber_px = 1, max_error_px = 20;  ///< either way; step; residuals
    int iterations = 30, rounds = 3;  ///< the offset changes which pictures lie within the trajectory
  } time_offset;
  struct Vignetting {
    double alike_moments = 4, outlier_sigmas = 4;                  ///< with correlated light; a shadow or a highlight
    double min_noise = 1e-4, min_variance = 1e-8, settled = 1e-3;  ///< of ln(light): synthetic pictures have none
    int max_rounds = 200, sigma_steps = 50;                        ///< angles whose 1σ is evaluated
  } vignetting;
  struct Response {
    /// 1σ in pixel values. Distance of a reading from both ends of the scale, where noise is clipped: by its measured
    /// value (a selection that is biased by noise), and by its fitted value. With the former alone a linear camera is
    /// wrong by 3.4 %. Strength of smoothing: cross-validation chooses among half decades.
    double first_noise = 2.5, min_noise = 0.3, max_noise = 8, min_bin_readings = 30;
    double measured_sigmas = 5, min_measured_codes = 3, fitted_sigmas = 2.5;
    double usual_strength = 1e8, min_strength = 1e5, max_strength = 1e11, strength_step = 3.1622776601683795;
    double max_slope_ratio = 4, min_information = 1e-6;  ///< to sRGB's: no divergence; on a pixel value, of the most
    double min_exposure_ratio = 4, max_residual = 0.05;  ///< longest over shortest; of ln(linear), median
    std::size_t max_pixels = 200000, min_pictures = 3;
    int folds = 4, first_rounds = 3, rounds = 8, light_steps = 3;  ///< light_steps: Gauss-Newton's, of a pixel's light
    int max_darkest = 24, min_brightest = 235;                     ///< pixel values seen at two exposures
  } response;
  struct Acceptance {  // limits above what calibration.md reports, so that usual boards are accepted
    double max_px = 0.5, max_moving_px = 1, max_outliers = 0.1, min_reached = 0.6;  ///< medians; of corners; of cells
    double max_focal_sigma = 0.002, max_centre_sigma_px = 0.5, max_sigma_px = 1;    ///< relative; px; at worst
    double max_turn_sigma_rad = 0.1 * (std::numbers::pi / 180), max_shift_sigma_m = 0.002, max_from_board_m = 0.01;
    double max_falloff_sigma = 0.05, min_transmission = 0.02, max_transmission = 2;  ///< relative, at the field's edge
    double max_offset_s = 0.28, max_offset_sigma_s = 0.002;  ///< inside time_offset's search: at its end is no minimum
  } acceptance;
} kCalibration;
}  // namespace lumigraft::reconstruct
