#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

namespace lumigraft::relight {
inline constexpr struct LookParameters {
  int lag = 4;           ///< frames between two that are compared: noise that a camera averages over time has decayed
  int tried = 48;        ///< patches per frame; their statistics cost 0.1 ms,
  int used = 16;         ///< and those of which the spectrum is measured, 0.3 ms
  float texture = 0.5f;  ///< variance of what both frames share over that of noise; sampling spreads it by 0.1 to 0.3
  float rounding = 1.0f / 12;               ///< variance of rounding to whole pixel values
  int remembered = 64;                      ///< patches of a level, of which a fraction
  float least = 0.2f, max_to_least = 2.5f;  ///< shows noise alone; variances up to this ratio are noise, too: noise of
                                            ///< 1.2 px spreads them by 1.5 (1σ)
  float frames = 60;                        ///< time constant; 1,000 patches give a spectrum to 3 %
  int level_codes = 16;                     ///< pixel values whose noise is measured together
  float few_patches = 2;         ///< weight of the curve that is fitted to all levels, against the measured level
  int first_patches = 8;         ///< before that noise is not known
  float max_slope = 0.5f;        ///< of the spectrum's logarithm over f², in (16 px)⁻²: noise smoothed by 1.8 px
  float max_change = 1.5f;       ///< of the variance; beyond that the camera's gain has changed,
  int change_patches = 32;       ///< over this number of patches
  int tile_patches = 512;        ///< between two tiles of noise; earlier ones at powers of two
  double blur_step_px = 0.05;    ///< smallest change of blur that is followed; an edge's width changes by a tenth
  double blur_motion_px = 0.25;  ///< √ of a change of variance that motion alone explains
  float min_blur_px = 0.1f;      ///< less widens an edge by 0.06 px
  double blur_frames = 8;        ///< time constant
} kLook;
}  // namespace lumigraft::relight
