#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

namespace lumigraft::relight {
inline constexpr struct ComposeParameters {
  float moved_sigmas = 3, moved_min_cosine = 0.2f;  ///< of depth, that noise explains; bound of a grazing view's
  float moved_jump = 0.03f;                         ///< fraction of the depth between neighbours of one surface
  float matte_sigma_px = 0.75f;  ///< 1σ of an outline's place in depth against colour, in 320ths of the width
  float matte_reach = 3, matte_samples = 4;  ///< times that: to pixels with a matte; and to those that give colours
  float matte_noise = 0.02f;                 ///< of a pixel's radiance, relative
  float max_flicker = 2;                     ///< ratio of a pixel's radiance of now to that of its change of light
} kCompose;
}  // namespace lumigraft::relight
