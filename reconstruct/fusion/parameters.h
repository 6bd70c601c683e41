#pragma once
// Parameters of fusion. FusionSettings can be set per stage; the rest are constants. Distances in voxels or truncation
// distances scale with the settings. Measured by tests/sweeps/fusion_sweep_test.cpp and tests/bench/fusion_time; no
// parameter without a figure below has been swept on its own.
#include <array>
#include <cstddef>
#include <cstdint>

namespace lumigraft::reconstruct {

struct FusionSettings {
  double voxel_m = 0.008;
  double truncation_voxels = 4.0;
  double far_m = 5.0;      ///< surfaces beyond it are fused in coarser voxels (CoarseParameters)
  double weight_cap = 64;  ///< limit of the summed weight of a voxel: bounds the time over which it averages
  /// Memory of bricks. A square metre of surface takes 540 bricks of 12.4 kB, 4.2 kB without colour (8 mm voxels); what
  /// is within far_m of the tag in a hall, 98 square metres of floor, wall and furniture, fits together with the coarse
  /// field.
  double max_memory_mb = 768;
};

/// The coarse field of surfaces beyond FusionSettings::far_m.
struct CoarseParameters {
  int voxels = 6;              ///< edge of a voxel: the truncation distance of 0.19 m is 1σ of depth at 10.5 m
  float far_m = 12;            ///< depth beyond it is not used
  float overlap_m = 0.5f;      ///< of depth in which surfaces are fused in both: more than a truncation distance
  float min_fraction = 0.01f;  ///< of an image that shows surfaces beyond `far_m`, from which a coarse field begins
  std::size_t pixel_step = 7;  ///< between the pixels that are counted for that; prime to the usual widths
  std::uint32_t interval_frames = 4;  ///< between those that are fused: far surfaces cover few pixels and change little
  std::size_t max_bricks = 600;       ///< updated in one of those, 10 to 15 us each
  /// Fraction of FusionSettings::max_memory_mb. 400 square metres, a hall of 12 m, take 6000 bricks, 73 MB.
  double memory = 0.15;
};
inline constexpr CoarseParameters kCoarse;

/// How often a brick is updated: an update adds about 1/n of what n updates gave, so that the interval grows with n. A
/// visitor must disappear within a second, and six frames must be averaged completely. On 1000 frames of a kitchen half
/// as many updates at each interval save an eighth of the time; the surface is equal.
struct UpdateSchedule {
  /// Updates after which a brick is updated in every second, fourth and eighth frame only.
  std::array<std::uint32_t, 3> settled_updates = {6, 12, 40};
  std::uint32_t active_updates = 8;  ///< a brick whose content moved is updated in every frame for so many updates
  int active_moved_voxels = 24;      ///< voxels of 512 far from their old distance that count as content that moved
  /// Bricks updated in one frame after the first, 10 to 15 us each, and 20 more for the memory of a new one; the others
  /// wait. Of a kitchen, every tenth frame, 91.6 % are known then, with 1000 90.5 % in a tenth less time; but then more
  /// than 3 % of the orbit's bricks are published per frame, since they drift more between updates.
  std::size_t max_bricks = 1300;
  /// Gain of a brick without the observed surface, relative to one with it in the middle: free space and the inside of
  /// things. With 0.3 1.4 % less of a kitchen is known, with 0.01 0.1 % more.
  float min_surface_fraction = 0.03f;
};
inline constexpr UpdateSchedule kUpdateSchedule;

/// What is evicted when bricks take more than FusionSettings::max_memory_mb (update_schedule).
struct MemoryParameters {
  std::uint32_t keep_frames = 16;  ///< bricks in view so recently are kept; twice the longest interval between updates
  float near_m = 1;                ///< bricks are needed the more the nearer they are to the tag, down to this distance
  double slack = 0.02;             ///< fraction of the memory that is freed at once
};
inline constexpr MemoryParameters kMemory;

/// How much of each frame is searched for new bricks. A fraction of the blocks is searched, in turns.
struct SearchSchedule {
  float still_m = 0.01f;             ///< camera motion since the last search: sum of translation over this
  float still_rad = 0.01f;           ///< and rotation over this; at most 1 = a camera at rest
  float other_view = 8;              ///< such motions after which the whole frame is searched
  int moving_subsets = 2;            ///< a moving camera's frames are searched by halves (12 to 19 % less time)
  int still_subsets = 4;             ///< those of a camera at rest by quarters
  std::uint32_t initial_frames = 4;  ///< searched whole and published at once, to know enough for the extrinsics check
};
inline constexpr SearchSchedule kSearchSchedule;

/// When a brick is published. Publishing a moving camera's bricks in every frame took 8 to 12 of 26 ms.
struct PublicationParameters {
  int urgent_moved_voxels = 8;           ///< so many voxels far from their old distance are published at once
  int urgent_new_voxels = 64;            ///< likewise newly known ones; urgent_moved_voxels in the initial frames
  std::uint32_t interval_frames = 4;     ///< smaller changes are published together
  float viewpoint_spacing_m = 0.25f;     ///< between the camera positions that a field lists
  std::uint32_t seen_space_frames = 16;  ///< between those whose image says what a viewpoint sees: it takes 3 ms
  std::size_t max_viewpoints = 64;       ///< bounds the memory and the time of those who read them
  /// RMS change since the last publication, as a fraction of a voxel, above which a brick is published: near surfaces
  /// and elsewhere.
  float drift_near_voxels = 0.02f, drift_away_voxels = 0.1f;
  float near_voxels = 2;            ///< a voxel within this distance is near a surface
  float near_margin_voxels = 0.5f;  ///< added in the upper bound of drift: a voxel that crosses it has drifted
  float drift_radiance = 0.01f;     ///< RMS change of radiance, relative
  double noise = 0.5;               ///< drift below this fraction of the noise of one measurement does not count
};
inline constexpr PublicationParameters kPublication;

/// Radiance of voxels while the light of the room changes (working_brick).
struct RadianceMemoryParameters {
  double log_sigma = 0.05;  ///< 1σ of an observation of weight 1: texture, gloss, pose; as of the colour gain's cells
  float min_ratio = 1e-3f;  ///< of light now over that before: less is as uncertain
};
inline constexpr RadianceMemoryParameters kRadianceMemory;

/// Planes and jumps in a depth image (depth_preprocess).
struct DepthPreprocessParameters {
  float max_slope = 5.0f;       ///< tan 79°: a steeper step between two pixels counts as a jump between surfaces
  float min_facing = 0.1f;      ///< cos 84°: planes seen at a more grazing angle are not used
  float jump_sigmas = 4;        ///< a jump exceeds the steepest surface by so much noise
  float crease_sigmas = 3;      ///< a second difference above it counts as a crease
  float crease_ratio = 0.5f;    ///< one side of a crease is used if its bend is below this fraction of the other's
  float jump_reach_voxels = 4;  ///< around a jump, in which voxels are updated one by one
  float min_jump_reach_px = 2, max_jump_reach_px = 48;  ///< limits of the same
};
inline constexpr DepthPreprocessParameters kDepthPreprocess;

/// Planes at grazing angles (steep_plane), up to DepthPreprocessParameters::min_facing.
struct SteepPlaneParameters {
  /// Edge of the window: depth cameras interpolate over up to three pixels across a jump, and a ramp of three in a
  /// window of twelve has 0.39 of its slope in either half.
  int window_px = 12;
  float min_measured = 0.75f;  ///< of the window's pixels, and of each half
  /// Of the window's slope, in both halves of it. Halfway between a plane (1) and a jump (0), whose errors are alike.
  float min_continued = 0.5f;
  float min_rise =
      0.15f;  ///< of a row's or column's difference, on both sides of the block: 0.45 on planes, 0 at jumps
  float max_noise = 1.5f;  ///< of the depth noise model, RMS: 144 pixels know it to 6 %, and sensors differ
};
inline constexpr SteepPlaneParameters kSteepPlane;

/// The observation of one voxel next to a jump or the image border (image_lookup).
struct DepthLookupParameters {
  float edge_weight = 0.25f;    ///< factor on the weight of an observation next to a jump or outside the image
  float behind_grazing = 2.5f;  ///< truncation distances along a ray that a surface is solid, at grazing angles too
  float rim_voxels = 1.5f;      ///< reach of planes at rims, where surfaces are solid near themselves only: no ledges
  float min_depth_m = 0.3f;     ///< least depth for which the reach of extrapolation in pixels is computed
  float occlusion_voxels = 2;   ///< within it of a jump, what one surface hides of the other is filled in
  float rim_slack_voxels = 0.75f;  ///< a cell that the rim passes through needs a corner behind the surface
  float deep_voxels = 3;           ///< a voxel deeper than this behind the measured depth,
  float deep_ratio = 1.02f;        ///< and this ratio, is not observed: a plane differs less from its own pixel
  float max_slope_change = 2;      ///< tangent of the angle by which a plane may turn from one block to the next
  float steady_voxels = 0.4f;      ///< planes with more noise are not extrapolated, since noise tilts them
  float noise_sigmas = 3;          ///< difference that noise explains
};
inline constexpr DepthLookupParameters kDepthLookup;

/// Which bricks a depth image observes (brick_selection).
struct BrickSelectionParameters {
  float near_m = 0.05f;          ///< nothing is fused closer to the camera
  float search_step_voxels = 3;  ///< spacing of the surface points at which bricks are searched; less than half a brick
  int block_stride = 4;          ///< largest spacing in blocks of 2 × 2 pixels; a power of two
  float open_truncations = 4;    ///< a brick is in open space if all along its rays is so far behind: planes up to 75°
};
inline constexpr BrickSelectionParameters kBrickSelection;

/// Update of voxels (brick_update).
struct BrickUpdateParameters {
  float free = 0.99f;         ///< of the truncation distance, from which a voxel counts as free
  float shell_voxels = 1.5f;  ///< colour, and the solid side of a rim, extend so far from the surface
  /// A measurement overrules the past if it differs by more than this fraction of the truncation distance
  float overrule_truncations = 0.75f;
  double overrule_sigmas = 4;  ///< and by more than so much noise of a measurement of its weight;
  float past_updates = 3;      ///< then the past counts as so many updates. A visitor disappears within a second
  double side_sigmas = 2.5;    ///< the two sides of a thin object differ by more noise than this
  float side_slope = 0.3f;     ///< and the field rises from one towards the other by more per voxel
};
inline constexpr BrickUpdateParameters kBrickUpdate;

/// Registration of real surfaces named by the session (real_surface). Chosen by hand; tested, not swept.
struct RealSurfaceParameters {
  float band_voxels = 3;              ///< half width of a model's field; the reach of ICP
  float model_voxel = 0.5f;           ///< voxel of a model in voxels of the room, since a plate may be thin
  float merge_voxels = 2.5f;          ///< distance from the model up to which it is merged
  float agree_voxels = 1.5f;          ///< difference up to which depth agrees with the model, besides noise
  float model_weight = 8;             ///< weight of a merged voxel: 1σ of 0.4 mm
  float mirror_max_roughness = 0.3f;  ///< a smoother and
  float mirror_min_metallic = 0.5f;   ///< more metallic surface is a mirror
  int columns = 160;                  ///< of depth points per row, since a model may be small in the image
  int min_points = 100;               ///< depth points that observe a model
  int min_mirror_points = 20;         ///< the same for a mirror, which has little depth of its own
  int max_frames = 8;                 ///< its pose is the mean over so many frames
  double prior_sigma_m = 0.01;        ///< 1σ of the position in the session, per axis
  double prior_sigma_rad = 0.02;      ///< 1σ of its rotation
  double warn_offset_m = 0.005;       ///< a larger offset from the session
  double warn_offset_rad = 0.01;      ///< or rotation is reported
  float far_m = 5;                    ///< depth beyond it is not used
  float noise_sigmas = 3;             ///< difference that noise explains
  float min_range_m = 0.05f;          ///< start of rays that test visibility
};
inline constexpr RealSurfaceParameters kRealSurface;

}  // namespace lumigraft::reconstruct
