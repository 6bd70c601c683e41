#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

namespace lumigraft::relight {
inline constexpr struct PassParameters {
  float min_fraction = 0.004f;                    ///< of a lamp's light: less is below one pixel value (8 bit)
  float steady_step = 0.125f, widest_rad = 1.2f;  ///< of a shadow's sphere, radii; half angle of a planar projection
  float min_lamp_radii = 1.1f;      ///< distance of a lamp with maps, in radii of the sphere around the objects
  float min_moved_near = 1e-3f;     ///< near plane of what moved: of the distance from the lamp to the objects
  int fine_picture_px = 480;        ///< width from which shadows are not computed per pixel
  int block_px = 8, margin_px = 3;  ///< of bounds in shadow maps; around objects' outlines, for supersampling, rounding
  int max_texture_px = 16384;       ///< that every desktop device allows along an edge
  int tested_px = 4, smooth_px = 4, blurred_px = 2;  ///< along each axis per sample, as the bound of the change varies
  float blur_px = 6;  ///< slowly; where all changes are smooth; where gloss blurs reflections by blur_px or more
  int mirror_samples = 5, shadow_cones = 2;  ///< per lamp: each a separate shadow, visible if few; on objects' vertices
  /// Of 64 threads: as many as a large GPU holds, 32 on each of 130 processors; with 1024 a software device took 4 %
  /// longer.
  int list_groups = 4096, list_groups_software = 256;
  int receiver_frames = 4;    ///< over which a map of lamps' receivers is updated while the last one is used
  int enclosure_texels = 24;  ///< along the edge of the octahedral map of the enclosure
  int enclosure_cones = 9;    ///< the minimum that covers a hemisphere evenly (Crassin et al. 2011 use 5 to 9)
} kPasses;
}  // namespace lumigraft::relight
