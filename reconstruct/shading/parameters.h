#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept. Measured: tests/bench/results/scene.md, sweeps albedo-*.
#include <cstddef>

namespace lumigraft::reconstruct {

struct ShadingParameters {
  /// Geometric mean albedo of a room's surfaces, assumed of all of which nothing is known: a floor that no camera saw,
  /// surfaces below the noise floor, and loosely the scale of albedo where no lamp's power is known. With a floor of
  /// this albedo in place of sky, the median error of albedo fell from 6.5 to 5.1 %, mean of six sessions.
  double typical_albedo = 0.35;

  float max_ray_m = 10;             ///< longest ray to a lamp: longer than a room
  float max_gather_m = 25;          ///< longest ray that gathers light: a hall of CoarseParameters::far_m both ways
  float lift_voxels = 1.5f;         ///< start of rays above their surface, against self-occlusion
  float lamp_radii_clear = 1.5f;    ///< shadow rays end this far from the lamp, as its body throws no shadow
  float on_side_ratio = 0.97f;      ///< a hit this far along the way to a side of the enclosure is on the side
  float noise_floor_ratio = 0.02f;  ///< of the samples' mean radiance: the darkest values of an 8-bit image
  float min_noise_floor = 1e-6f;    ///< radiance, for samples that are all black

  struct Surroundings {
    int min_measured_sides = 2;  ///< for guessed sides to count: one may be a table; if 0, albedo is 3 times worse
    float below_floor_fraction = 0.02f;  ///< of known surface below the floor: noise
    int floor_cells = 60;  ///< per edge of the grid of lamp light on an unseen floor; beyond it there is none
    float floor_cell_m = 0.15f;
    float above_floor_m = 0.05f;       ///< where shadow rays to that floor end: its height is as uncertain
    double lamp_distance_m = 1.5;      ///< assumed for lamps at unknown distance
    std::size_t near_fill_stride = 7;  ///< of the far cells from which a near cell is filled, for speed
  } surroundings;

  /// Unobserved space in which something may occlude a lamp.
  struct UnobservedSpace {
    float start_m = 0.03f, range_m = 1.0f;  ///< from the surface towards the lamp
    float step_m = 0.008f;                  ///< a voxel
    float min_width_m = 0.008f;  ///< along the ray: SeenSpace makes the space of a thin edge wider than it is
  } unobserved;

  struct ClippedWalls {
    float max_gain = 8;                  ///< over the clipping level: brighter spots are lamps on the wall
    int samples = 3;                     ///< per edge of a cell, of a side's irradiance
    float min_irradiance_ratio = 1e-4f;  ///< over the brightest cell: below it albedo of the side is not determined
    float lift_m = 0.02f;                ///< start of shadow rays above the side
  } clipped_walls;

  struct Samples {
    float min_cell_voxels = 2;         ///< smallest edge of a sample's cell
    float finest_m2 = 1, fine_m2 = 4;  ///< squared distance from the tag at which cells double: 1 m and 2 m
    std::size_t min_slope_points = 8;  ///< of a patch, to fit a slope of radiance
    float min_normal_length = 0.95f;   ///< of a patch's mean normal, to be one smooth piece: 18° RMS
    float min_cell_growth = 1.05f;     ///< per round of the search for a cell size
    int neighbours = 6;                ///< of a sample, the nearest
    float neighbour_reach = 2.5f;      ///< in edges of its cell,
    float same_orientation = 0.8f;     ///< and whose normals have this cosine
    float max_clipped = 0.02f;  ///< of the surface around it: that shifts the mean of a texture by -φ(z) / (1 - p)
                                ///< = 0.05 of its standard deviation
  } samples;

  /// The white paper of the tag. About half of it is black; blur turns most of the white grey, and noise lifts the
  /// brightest points. So the white is measured between two of the brightest ranks.
  struct TagPaper {
    float thickness_m = 0.015f;  ///< of paper on a board, and of the field's error
    float min_normal_z = 0.9f;   ///< cosine to the tag's normal
    std::size_t min_points = 40;
    std::size_t first_rank = 20, last_rank = 5;  ///< 1/rank of the points, by falling radiance
    std::size_t black_rank = 10;                 ///< 1/rank of the points from the darkest
    float max_black_ratio = 0.6f;                ///< black over white: above it something covers the print
    std::size_t check_20ths = 7;                 ///< rank in twentieths that must still be white,
    float min_white_ratio = 0.75f;               ///< at least this: clipped white is not fused, what remains is grey
  } tag_paper;
};

inline constexpr ShadingParameters kShadingParameters{};
inline constexpr float kTypicalAlbedo = static_cast<float>(kShadingParameters.typical_albedo);

}  // namespace lumigraft::reconstruct
