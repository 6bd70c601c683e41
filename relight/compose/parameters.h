#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

#include <cstddef>
#include <cstdint>

namespace lumigraft::relight {
inline constexpr struct ComposeParameters {
  float moved_sigmas = 3, moved_min_cosine = 0.2f;  ///< of depth, that noise explains; bound of a grazing view's
  float moved_jump = 0.03f;                         ///< fraction of the depth between neighbours of one surface
  int moved_max_edge_px = 6;                        ///< bound of a voxel's size in the image
  float gone_fraction = 0.5f;    ///< of a brick's surface, that depth sees through: noise shows some of any as gone
  int gone_cell_voxels = 2;      ///< edge of the cells of what is gone; the field displaces surface by up to a voxel
  int gone_max_cells = 1 << 18;  ///< at most: 32 KB. A person is 10^5 of 2 cm
  float matte_sigma_px = 0.75f;  ///< 1σ of an outline's place in depth against colour, in 320ths of the width
  float matte_reach = 3, matte_samples = 4;  ///< times that: to pixels with a matte; and to those that give colours
  float matte_noise = 0.02f;                 ///< of a pixel's radiance, relative
  float matte_shade = 0.5f;  ///< 1σ of the shading of one surface, relative: limbs are lit from one side
  /// Without a pose for unseen_ns all that is added fades out at the last pose, within fade_out_ns: five frames at 30 a
  /// second, in which a camera held in a hand moves 2 to 10 cm. In slowly, as poses may be lost again.
  std::int64_t unseen_ns = 70'000'000, fade_out_ns = 180'000'000, fade_in_ns = 400'000'000;
  /// Between two frames with depth, at most, for it to be a usual interval. A depth camera that is slower shows no
  /// hands.
  std::int64_t max_depth_interval_ns = 500'000'000;
  /// A covered lens: brightness and contrast (difference of blocks' mean pixel values, 5 to 95 %) fall below these
  /// fractions of their averages over usual_view_ns; twice as much ends it.
  float covered_light = 0.15f, covered_contrast = 0.2f, covered_hysteresis = 2;
  std::int64_t usual_view_ns = 3'000'000'000;
  int view_block_px = 16, view_step_px = 4;
  float min_contrast = 6;  ///< pixel values; any room has more
  float max_detail = 4;    ///< ratio of the radiance of one side to that of a mixture with it
  /// Of an object over the exposure: bound in the image, and samples of the mean along it, a step of half a pixel.
  float max_motion_px = 64, motion_samples_per_px = 2;
  float matte_change =
      0.01f;                ///< of a pixel's radiance: smallest difference of the changes on both sides of an outline
  float lag_px = 8;         ///< largest displacement of depth, 320ths of the width
  float lag_gain = 0.7f;    ///< cost over that without displacement, below which there is one
  float lag_contrast = 24;  ///< pixel values between two sides, that show a step
  std::size_t lag_points = 400, lag_min_steps = 40;  ///< points of an outline that are evaluated; steps that suffice
  float max_flicker = 2;     ///< ratio of a pixel's radiance of now to that of its change of light
  int shell_hole = 3;        ///< pixels without depth inside a surface, at most
  float shell_round = 0.5f;  ///< of a round limb's half; swept on an arm: 1 fits its forearm, its palm gets too thick
  float shell_slope = 4;     ///< of depth at an outline, bound: more is a mixture of two surfaces
  int shell_rounds = 200;    ///< at most; each spreads depth by about a pixel
  float shell_settled_m = 0.0002f;  ///< a tenth of the noise of depth at 1 m
} kCompose;
}  // namespace lumigraft::relight
