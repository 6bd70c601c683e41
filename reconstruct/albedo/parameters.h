#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept. Measured: tests/bench/results/scene.md ("Light and albedo"), sweeps albedo-*.
#include <cstddef>
#include <cstdint>

namespace lumigraft::reconstruct {

struct AlbedoParameters {
  struct Stage {
    int max_samples = 2500;                        ///< bounds the time of a solution: 400 to 1100 ms of processor time
    int gather_rays = 64, rough_gather_rays = 16;  ///< per sample; rough in the first of two passes
    float max_metal_fraction = 0.1f;               ///< of a sample's rays; more distorts its irradiance
    double search_growth = 1.5;          ///< of known surface, after which lamps are searched without earlier estimates
    double locate_growth = 1.1;          ///< of known surface, after which lamps are searched around earlier estimates
    double locate_weight = 4;            ///< as by that of the weight of its measurements: their noise is half
    float same_direction = 0.9999f;      ///< cosine of 0.8°: beyond it a lamp turned and is searched again,
    float same_irradiance = 0.05f;       ///< as beyond this relative change,
    float same_position = 0.01f;         ///< and, with a tag, beyond this change over its distance
    std::size_t max_estimates = 64;      ///< of lamps, those that are off among them, which are dropped beyond it
    int check_solves = 12;               ///< complete solutions between checks of the fish-eye's pose
    int locate_solves = 8;               ///< complete solutions between searches for lamps
    int incremental_solves = 32;         ///< incremental solutions between complete ones
    double max_changed_fraction = 0.25;  ///< of the surface, for an incremental solution
    float max_environment_change = 0.05f;  ///< relative, for an incremental solution
    float other_light = 0.05f;             ///< relative change of light, after which what was solved is prior knowledge
    float kept_information = 0.75f;        ///< of it: surfaces change, too
    float guess_log_sigma = 0.3f;          ///< of a lamp's power or distance, above which a warning calls it a guess
    float max_distance_m = 7.5f;  ///< beyond it a lamp counts as infinitely far (sweep light-distance: 2° off)
  } stage;

  /// Lamps that moved or changed, while albedo is known.
  struct Following {
    std::size_t max_samples = 600;      ///< bounds the time: 20 to 40 ms of processor time
    float min_samples_fraction = 0.6f;  ///< of them that must still be there
    int gather_rays = 32;               ///< per sample
    double min_change = 0.01;           ///< relative, of the light
    /// A lamp's distance is searched again where its share of the lamps' light rose by this factor, to min_share at
    /// least: what shading says of it rises with the square.
    float clearer_share = 1.5f, min_share = 0.2f;
    int solves = 8;  ///< between complete solutions, which learn more of albedo
  } following;

  struct MissingLight {
    int paper_rays = 64;            ///< gathered on the tag's paper
    float max_paper_albedo = 0.9f;  ///< office paper reflects 75 to 87 %
    /// Of what surfaces can reflect, above which the fish-eye's image does not have most of the light, however wrong
    /// the scale of the two cameras is.
    float max_reflected = 2;
  } missing_light;

  struct Gather {
    std::uint32_t refresh = 8;       ///< solutions within which every sample is gathered anew
    float max_light_change = 0.05f;  ///< relative, before all are (relative_change)
    double growth = 1.1;             ///< of known surface, before all are
    float near_cells = 0.4f;         ///< distance of equal samples, in edges of their cell
    float same_normal = 0.97f;       ///< cosine
  } gather;

  /// Irradiance and its uncertainty, relative unless stated.
  struct Lighting {
    int sample_rays = 8, point_rays = 4;  ///< to the disk of a lamp of half the light; twice as many change nothing
    float model_error = 0.08f;            ///< 1σ of modelled irradiance of a sample, away from shadow edges
    float scale_error = 0.01f;            ///< 1σ of the two cameras' scale, in light that the fish-eye measured
    float lamp_error = 0.02f;             ///< 1σ of the fish-eye's radiance, which all solutions share
    int directions_around = 8;            ///< in which a sample's surroundings are searched for unmeasured surface,
    float max_gap = 0.75f;                ///< which has no sample within this, in edges of the sample's cell
    float edge_error = 0.35f;             ///< of a lamp's light, times the variation of its visibility around a sample
    float negligible_edge = 0.02f;        ///< of all light: what the edges of all lamps may be off without rays
    float max_distance_slope = 4;         ///< of log irradiance by log distance: beyond it surface is grazed
    float metal_sigma = 0.02f;            ///< absolute, of albedo 0: metal is configured
    float weight_softening = 0.05f;       ///< squared cells, in the weights of samples around a point
    float min_albedo = 0.02f;             ///< lower clamp before the logarithm
  } lighting;

  struct Solver {
    double smooth_sigma = 0.03;  ///< of albedo between neighbours without an edge
    double edge_sigma = 0.15;    ///< of the log ratio of B / E that makes an edge
    double min_weight = 0.01;    ///< of smoothness; less is left out
    double huber = 2;            ///< σ beyond which residuals count linearly
    int iterations = 15, linear_iterations = 40;
    double tolerance = 1e-4;     ///< of the cost, relative
    double misfit_sigma = 0.5;   ///< 1σ of albedo over the difference of solution and measurement,
    double trusted_error = 0.1;  ///< which counts less where irradiance is less certain than this
    float max_sigma = 0.35f;     ///< of albedo: as uncertain as a guess, so unknown
  } solver;

  /// Surface that clips in all frames.
  struct Clipped {
    int min_voxels = 16;                 ///< of an area; fewer are highlights and noise
    int voxels = 128, gather_rays = 16;  ///< of an area that are read, and rays for the light of each: 2 ms
    float quantile = 0.95f;              ///< of their bounds, from which on their mean is taken
    float max_albedo = 0.9f;             ///< white paper; more is an error of the light
    float sigma = 0.15f;                 ///< 1σ of what is found so
    int beyond_voxels = 2;               ///< beyond its border pixels show both sides no more
    float same_albedo = 0.9f;            ///< of the bound: less is another material; of hues' ratios
    float same_grain = 0.6f;             ///< ratio of brightness within one material, as of wood; of the border
    float min_continued = 0.1f;          ///< where the same continues, from which it shows the albedo
  } clipped;

  /// A sample in the shadow of an unobserved object is darker than the plane around it.
  struct Unobserved {
    float reach_m = 0.5f, plane_m = 0.03f, same_normal = 0.95f;  ///< of samples on the same plane; the last a cosine
    std::size_t min_samples = 12;                                ///< on that plane
    /// 1σ of log albedo by error of modelled light, and by how many σ a shadow differs: in all by 0.15 at least.
    float model_sigma = 0.06f, min_sigmas = 2.5f;
    float max_unexplained = 0.5f;     ///< of the difference, left without the lamp
    float min_lamp_fraction = 0.15f;  ///< of a sample's light
    int steps = 8;                    ///< tried fractions of a lamp
    float min_albedo = 0.02f;         ///< lower clamp before the logarithm
  } unobserved;

  /// Occluders of such shadows.
  struct Carving {
    float max_left = 0.5f;      ///< of a lamp's light at a dark sample; the rest is a penumbra or the model's error
    float min_visible = 0.75f;  ///< of a lamp's disk at a lit sample
    float sample_reach = 1;     ///< of a patch around its sample, in edges of its cell
    float lift_voxels = 2;      ///< start of lines above their surface
    float far_m = 3;            ///< longest line from a sample, or behind a voxel
    float weight = 0.01f;       ///< of an occluder's voxels, as they were not observed
  } carving;

  struct Incremental {
    float same_summary = 0.02f;  ///< relative change of radiance and count: the accuracy of the lamps' light
    float same_centroid_voxels = 1;
  } incremental;

  struct Bricks {
    int reach = 3;  ///< voxels around surface points that take their albedo, for interpolation
    float same_rms = 0.01f, same_max = 0.04f;  ///< of albedo: smaller changes are not visible and not published
  } bricks;
};

inline constexpr AlbedoParameters kAlbedoParameters{};

}  // namespace lumigraft::reconstruct
