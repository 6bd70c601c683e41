#pragma once
// Every number that decides something in this folder. Where no reason is given the value was chosen by hand and not
// swept. Measured: tests/bench/results/scene.md ("Light and albedo"), sweeps light-power, light-distance, albedo-*.
#include <cstddef>

#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {

struct LampParameters {
  /// Where the direction of a panel that faces the tag needs a distance, and centre of the prior without a fish-eye.
  double usual_distance_m = kShadingParameters.surroundings.lamp_distance_m;
  /// 1/m, over which a lamp that is fully visible, or occluded, at both ends is so between: the shadow of an edge 0.3 m
  /// above a table moves by no more than a sample's cell.
  double max_visibility_span = 0.3;

  struct Pairs {
    int neighbours = 4;             ///< nearest samples, of any orientation
    int far = 6, far_tries = 40;    ///< samples of the same orientation, and random draws to find them
    float far_reach_m = 1.0f;       ///< shading over a larger part of a floor or wall says more
    float same_orientation = 0.9f;  ///< cosine
    float touching_cells = 1.8f;    ///< distance of samples whose cells share an edge or a corner, over the cells' edge
    float sample_error = 0.08f;     ///< 1σ of log irradiance, as for albedo
    float min_albedo = 0.02f;       ///< lower clamp before the logarithm
  } pairs;

  struct Search {
    /// Of the grid, whose ends are 0 and the first: even steps of inverse distance move shadows by even steps.
    double max_inverse_distance = 2.5;
    int grid_steps = 18;
    double fine_reach = 0.22;      ///< of an inverse distance, either way: one step of the grid at 1.5 m and a little,
    double min_fine_reach = 0.08;  ///< 1/m, at least
    double fine_limit = 0.7;       ///< of that reach: beyond it visibility is tabulated anew
    int fine_steps = 11;           ///< distances found with 15 differ by less than 1 %, with 7 by 4 %
    /// 1/m, of lamps that are as good as infinitely far; the likeliest is compared with the lamp's best distance.
    double distant_inverse[2] = {0, 1 / 12.0};
    int follow_rounds = 4;       ///< of the search around earlier estimates: a factor of 1.8 of distance
    int fine_rays = 5;           ///< over a lamp's disk
    double max_gain = 1 << 18;   ///< of a clipped lamp: the sun over the level of a well-exposed sky
    int gain_steps = 19;         ///< one per power of two
    int near_gain_steps = 5;     ///< in coordinate descent: a factor of 4 either way
    int paper_rays = 64;         ///< gathered on the tag's paper
    std::size_t stride = 3;      ///< a third of the samples is enough for the search
    int rounds = 3;              ///< of coordinate descent
    std::size_t shaped = 3;      ///< strongest lamps for which the other shape and a beam are tried
    float facing_cosine = 0.3f;  ///< of start normals to the direction of the lamp: else they face away
    /// PointLight::squareness below which an outline is surely round, and above which it surely has four corners. A
    /// shape that contradicts the outline multiplies the robust sum by 1 + outline_penalty.
    float round = 0.1f, quadrilateral = 0.3f;
    double outline_penalty = 0.1;
    /// A beam must lower the robust sum to this fraction: over eleven rooms without beams it lowered it to 0.99 at
    /// least. And by this much per pair: where all pairs agree the rest of the sum is the error of the model. Rooms
    /// with spots in tubes improved from relight_error 0.595 and 0.571 to 0.494 and 0.550.
    double max_beam_cost = 0.95, min_beam_gain = 0.03;
    double max_beam_distance_m = 8;  ///< beyond it a lamp counts as infinitely far
    double beam_nearer = 0.78;       ///< of inverse distance: a beam's search starts beyond the isotropic lamp
    float beam_log_sigma = 0.2f;     ///< 1σ of log distance: narrower beams from farther away fit as well
  } search;

  struct Posterior {
    double min_distance_m = 0.3;
    double max_tilt = 4;    ///< tangent: 76°
    double max_gain = 1e6;  ///< above that of the search
    double step = 1e-3;     ///< of numeric derivatives
    int rough_iterations = 20, fine_iterations = 60;
    double rough_tolerance = 1e-5, fine_tolerance = 1e-6;  ///< of the cost, relative
    double pair_scale = 0.1;  ///< RMS difference of log albedo that is large: textures vary by about this
    double wide_level = 4;    ///< level of the robust cost during the search; the last solution has 1
    /// Errors of the model (of gathered light, of normals) are equal over a whole surface, so that this many pairs are
    /// one independent observation. No pair is better than model_error of the light. With both, the power of a clipped
    /// lamp was never off by more than 1.2 of its sigmas in the sessions.
    double pairs_per_observation = 600;
    double pairs_per_sample = Pairs{}.neighbours + Pairs{}.far;  ///< of which each has the own errors of two samples
    double usual_pair_variance = 20;  ///< v of the prior in the coarse search; it is estimated from 8 to 70
    double model_error = 0.02;
    /// Scale of albedo where a lamp's power is unknown: albedo with 1σ of its logarithm, of white paper (office paper
    /// reflects 75 to 87 %) and of the mean
    /// of a room.
    double paper_albedo = 0.8, paper_log_sigma = 0.07;
    double room_albedo = kShadingParameters.typical_albedo, room_log_sigma = 0.5;
    /// Lamps hang 1 m (over a table) to 3 m (under a ceiling) above a fish-eye, and at the end of a hall farther:
    /// inverse distance over the sine of elevation, and its scale. Lamps on desks and in hands are nearer: the tail is
    /// that of a Cauchy distribution, down to inverse_distance_sigma.
    double inverse_height = 0.5, inverse_height_scale = 0.4;
    double alike_inverse_height = 0.1;  ///< scale of the same for clipped lamps of a kind: a fifth of their height
    /// Log odds of a lamp in the room against one that is infinitely far, as the sun: 20 to 1. Windows and the end of a
    /// hall have a small elevation: at the usual height they are so far that it hardly matters.
    double ceiling_log_odds = 3;
    /// 1σ of wide priors: of inverse distance (1/m), of tilt (tangent), and of log gain, a factor of 25.
    double inverse_distance_sigma = 1, tilt_sigma = 1, gain_log_sigma = 3.2;
    /// A clipped lamp's log colour lies near the line of black bodies from 6500 K (white) to 2700 K, in linear Rec. 709
    /// without its mean: unit vector of the line, its usual value (half of the way), and 1σ along it and across.
    /// Drawn to white instead, the blue of a bulb was 26 % too strong.
    double warm[3] = {0.631, 0.134, -0.765};
    double usual_warmth = 0.8, warmth_sigma = 2.4, hue_sigma = 0.6;
    /// Of log radiance of a channel. Clipped lamps of a kind: luminaires age by 0.3, and 3000 K is 0.5 redder than 4000
    /// K. Of any kind: tubes and frosted bulbs differ by a factor of 5 to 10.
    double alike_log_sigma = 0.5, any_log_sigma = 2.5;
    double log_dim = 3.4;               ///< log gain at which an unseen lamp is dim but matters: 3 % of all light
    double contradiction_sigmas = 4.7;  ///< of the earlier solutions: 0.1 % of six normal variates exceed it
  } posterior;

  /// Earlier solutions as prior of the next.
  struct Memory {
    double kept = 0.75;              ///< of their information: about four solutions count
    float same_direction = 0.9999f;  ///< cosine of 0.8°
    float same_irradiance = 0.2f;    ///< relative change of a measured irradiance
    /// 1σ of log intensity towards the probe of a lamp that was carried: of its measured flux; per radian by which its
    /// elevation changed, as an upright lamp emits alike all around, and bulbs within a quarter of their mean over 135°
    /// of elevation (ENERGY STAR, omnidirectional lamps); and per radian of direction, by a hand that turns it.
    double flux_log_sigma = 0.01, raised_slope = 0.13, turned_slope = 0.03;
    double changed_sigmas = 3.3;  ///< beyond which an intensity probably changed: 0.1 % of normal variates exceed it
    /// Places that an earlier run of the program found. A lamp that was carried along its direction by so much differs
    /// in size by as much.
    float same_size = 0.15f;       ///< relative change of the angular radius
    float kept_log_sigma = 0.05f;  ///< added to that of a kept distance: errors that both runs share
    std::size_t max_kept = 64;     ///< also of lamps that did not shine in this run
  } memory;

  struct Reflections {
    float max_ray_m = 10;
    float min_contrast = 4;         ///< radiance of a lamp over the surface in front of it
    float disk_reach = 0.7f;        ///< of the lamp's radius, where its disk is sampled
    float min_up_cosine = 0.7f;     ///< of a normal to the tag's, of a surface that is lit from above
    int min_up_hits = 3;            ///< of five, and of plane_samples
    int plane_samples = 32;         ///< on the way over the plane to a reflection
    float image_slack_rad = 0.02f;  ///< 1°: a rough surface or tiles that are not level turn an image by no more
  } reflections;

  /// Lamps that are fused as surface.
  struct Seen {
    int rays = 16;            ///< over the disk, and in the ring around it
    float disk_reach = 0.9f;  ///< of the disk's radius
    float beyond = 2;         ///< radius of the ring, over that of the disk
    float max_ray_m = 10;
    /// Radiance of the lamp over that of surface that is the lamp. A plane that a lamp lights gets less than half of
    /// its hemisphere from it, so that it has less than half of its radiance.
    float max_contrast = 2;
    float min_radius_rad = 1e-3f;  ///< of a lamp that the fish-eye does not resolve
    float resolved_voxels = 4;     ///< smallest radius at which a ball bulges by more than two voxels
    float mixed_voxels = 1.5f;     ///< around the lamp's outline, where colours are interpolated across it
    float max_reach = 3;           ///< of the lamp's surface, over the disk's radius: a rectangle of 1 to 11
  } seen;

  struct OutOfView {
    float min_power = 1e-3f;     ///< of all light at the probe: lower end of the search
    float off_power = 0.05f;     ///< of all light: a lamp surely below it is off, as shading resolves no less
    float max_log_sigma = 0.3f;  ///< of the power found; above it a previous or configured power is better
    float housing_m = 0.05f;     ///< around a lamp that does not count as occluder
  } out_of_view;

  /// Without a fish-eye.
  struct FromShading {
    double growth = 1.5;           ///< of known bricks, after which the light is estimated again
    float probe_height_m = 0.05f;  ///< above the tag's centre
    int max_samples = 800;         ///< cells of about 5 cm on a table and the wall behind it: 0.5 to 1.5 s of processor
    int gather_rays = 64;          ///< per sample, as for albedo
    std::size_t reference_stride = 8;  ///< of samples whose median albedo is assumed where there is no paper
    int directions = 256;              ///< over the sphere: 13° apart
    float distances_m[4] = {0.7f, 1.2f, 2.2f, 6.0f};  ///< about a factor of 2 apart; the last as good as infinite
    float angular_radius_rad = 0.07f;                 ///< of lamps: a bulb of 14 cm at 1 m; penumbrae say little of it
    std::size_t max_lamps = 3;                        ///< more share the evidence: each would be uncertain
    int max_log_power = 6;       ///< either way, of a lamp's irradiance over the unknown radiance: nothing, or the sun
    std::size_t finalists = 12;  ///< of the grid, whose colours are fitted
    int rounds = 3;              ///< over all lamps of the grid
    int fine_rays = 5;           ///< over a lamp's disk
    float fine_steps[3] = {0.16f, 0.08f, 0.04f};  ///< radians: from below the grid's spacing to 2°
    float fine_distance = 1.5f;                   ///< step of log distance over that of the direction
    float rough_log_steps[4] = {0.6f, 0.6f, 0.3f, 0.3f}, fine_log_steps[2] = {0.1f, 0.1f};  ///< of powers
    int fine_rounds = 4;                                                                    ///< per step
    /// A lamp must lower the robust sum to max_cost of that without it, and by min_gain per pair: where all pairs agree
    /// the rest of the sum is the error of the model. It is refined if the grid's best lowers it to max_first_cost.
    double max_cost = 0.9, max_first_cost = 0.95, min_gain = 0.03;
    /// Wide priors of a lamp's colour and distance: their weight in pairs that do not agree at all, and 1σ. Colours of
    /// black bodies from 2700 K to 10000 K differ by about hue_log_sigma from white, RMS over the channels.
    double prior_pairs = 3;
    float hue_log_sigma = 0.5f, distance_log_sigma = 0.5f;
    float power_log_sigma = 0.5f;           ///< as published: power and distance are correlated, and neither was seen
    float min_unknown = 0.1f;               ///< of a sample's irradiance: known surface is not all its light
    float min_relative_irradiance = 1e-3f;  ///< of a sample over the unknown radiance: it is a divisor
  } from_shading;

  struct KnownLamps {
    float same_direction = 0.9999f;  ///< cosine of 0.8°: beyond it a lamp is another
    double growth = 1.5;             ///< of known surface, after which a lamp may turn out to be a reflection
  } known_lamps;
};

inline constexpr LampParameters kLampParameters{};

}  // namespace lumigraft::reconstruct
