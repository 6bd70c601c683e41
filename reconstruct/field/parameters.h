#pragma once
// Thresholds of the field folder.
#include <cstdint>

namespace lumigraft::reconstruct {

struct FieldParameters {
  // Rays for light transport (field_rays).
  std::uint8_t max_gap_bricks = 8;       ///< limit of the map of empty space; bounds the time to build it
  float interpolation_reach_voxels = 2;  ///< beyond it the nearest voxel's distance is exact enough to step by
  float min_ray_step_voxels = 0.7f;      ///< less than a voxel, so that no layer of voxels is skipped
  float max_distance_slope = 4;          ///< change of distance per length of a fused surface (exact: 1); not swept
  // Meshes to fields (real_surface_mesh).
  float min_triangle_cosine = 0.6f;  ///< direction to the voxel to normal; next to a corner of a cube: 0.577, unknown
  float equal_distance_m = 1e-5f;    ///< triangles whose distances differ by less count as equally near
  // Metal (metal_mask).
  float min_metallic = 0.5f;         ///< `metallic` of a real surface from which it counts as metal
  float mirror_thickness_m = 0.03f;  ///< distance from a plane found to be a mirror: its fit and depth noise
  float metal_cell_m = 0.012f;       ///< 1.5 voxels of 8 mm: by so much the field's surface may be off the mesh
  float tag_slack_m = 0.015f;        ///< distance from the tag's plane that counts as tag; chosen by hand
  /// Normals of meshes (normal_filter).
  struct NormalFilter {
    float max_noise = 0.2f;  ///< slope per noise of a distance over a voxel: fusion leaves half of it, as measured, and
                             ///< cameras are up to twice as noisy as the model
    float range_sigmas = 3;  ///< difference that noise explains: an edge that is sharper is kept
    float pass_rad = 0.0044f;  ///< 0.25°: a pass for so much noise. Four leave less than 1° of 1°, 1 % of light at 45°,
    int max_passes = 16;       ///< and 16 1.5° of 10°; they reach five voxels
  } normal_filter;
  /// What an image hides (seen_space).
  struct SeenSpace {
    int cell_px = 2;          ///< edge of a cell; together with the next one about a voxel at 1 m
    float margin_voxels = 2;  ///< in front of a surface: by so much the field and the poses may be off
    float min_jump = 0.03f;   ///< of depth between cells, relative, besides the margin, at an outline; a slope has less
  } seen_space;
};
inline constexpr FieldParameters kFieldParameters;

}  // namespace lumigraft::reconstruct
