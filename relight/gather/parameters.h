#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <cstdint>

namespace lumigraft::relight {
inline constexpr struct GatherParameters {
  int probe_block = 64, patch_block = 4096, mesh_block = 1024;  ///< elements per thread at a time
  int max_interfaces = 16;   ///< of transmissive objects on a path, e.g. by total reflection within them
  int split_interfaces = 2;  ///< where a camera's ray enters and leaves, reflection and transmission are both traced
  /// Of GGX: photons bring the light of lamps that metals up to it reflect to matt surfaces. As wide is the lobe that
  /// one of 12 rays over the hemisphere, those of a pixel with the default plan, finds at least (surface_within).
  float photon_alpha = 0.2f;
  float narrow_alpha = 0.05f;                        ///< of GGX: the lobe of a transmissive object is a few pixels wide
  float seen_voxels = 2, seen_far_fraction = 0.01f;  ///< sum, of voxels and of the distance: off a pixel's surface
  int mirrors = 2, filter_steps = 2;  ///< further specular reflections of a path; of gathered light: spacing 1 px, 2 px
  float grazing = 0.05f, min_detail = 0.2f, max_detail = 4;  ///< cosine of a plane; radiance over its surroundings'
  double min_nearest_m = 0.05;                               ///< distance to the objects, if the camera is among them
  float lift_m = 1e-4f, paper_m = 0.005f, patch_m = 0.02f;   ///< of rays; of the tag's plane; between surface patches
  int window_px = 16;                                        ///< edge of squares that are tested as one,
  float window_margin_rad = 0.002f;  ///< with this margin for the curvature between the test points
  int max_bounces = 12;              ///< until one more brings the fraction `settled`; later ones are summed by
  float settled = 0.003f, max_bounce_ratio = 0.95f;  ///< their ratio, up to max_bounce_ratio
  float cells_across = 8, probes_across = 16;        ///< along the radius of the objects' sphere, or an object's
  float probe_reach = 1.2f, probe_exponent = 4;      ///< times their spacing; of the cosine in a vertex's weights
  float off_px = 1.5f, near_fraction = 0.5f;         ///< to a plane of one surface; of an object's distance: even light
  float block_off_plane = 1.5f, block_alike = 0.95f;  ///< in blocks; similarity from which two count as one surface
  float block_unlike = 1e-6f;  ///< weight of blocks of other surfaces: effective only if there are no others
  float hole_reach = 0.04f, hole_color = 0.15f, hole_near_color = 0.1f;  ///< image widths; sRGB, 0 to 1; like reach
  float shared_off_plane_px = 1, shared_cosine = 0.7f;  ///< of surfaces that share the shadows of a pixel
  float surely_farther = 1.02f, jump_px = 8;            ///< times an object's distance; depth step to another surface
  int max_triangles = 200000, lamp_points = 8;          ///< per object; per lamp, at a probe of an object
  int first_bounces = 8, later_bounces = 2, probe_rays = 4;  ///< on new objects; later; per ray of a cell
  /// Times plan.rays: rays of a probe of an object. Its noise is one value over many pixels. From 1 to 3, four rendered
  /// sessions lose 6 to 20 % of object_error for 5 to 10 % more time, from 3 to 6 another 1 to 5 % for twice that.
  int object_rays = 3;
  int gloss_rounds = 4;  ///< of rays of a glossy pixel, as long as it is noisier than a step of an 8-bit picture
  float edge_round = 1.5f, edge_reach = 6;     ///< voxels: in which fused normals turn; to the next plane
  float edge_flat = 0.96f, edge_turn = 0.87f;  ///< cosines of 16°, a sphere's of 6 voxels radius; of 30°: less is noise
  float edge_off = 1.5f, edge_lift = 0.1f;     ///< voxels: measurement to plane; points above it, as its noise occludes
  float edge_unlike_color = 0.1f, edge_unlike = 0.25f;       ///< of sRGB, 0 to 1, is as unlikely as voxels from a plane
  float penumbra_sigma = 0.35f, wide_px = 4, sparse_px = 6;  ///< filter over penumbra; penumbrae from which visibility
  int penumbra_reach_px = 2;                                 ///< is even over a pixel, and 1 of 2 × 2 px suffices
  int moved_normal_px = 3;                                   ///< reach of the normal's differences
  int moved_sample_px = 4;                                   ///< between samples that find it in the field
  float moved_far_m = 12;                                    ///< beyond it nothing is fused
  int moved_vertices = 10000, gone_surfaces = 16;            ///< at most, of an occluder; behind one another on a ray
  int clipped_reach_px = 12;    ///< around a pixel in which all channels clip: those in which one does not correct it,
  float clipped_prior = 0.02f;  ///< by half if they are so much of the square
  float gone_margin_m = 0.1f;   ///< around what is gone: its sides that no camera saw
  float light_reach = 2;    ///< voxels around a pixel over which the median separates light from texture: blur is 1.5
  int light_max_px = 12;    ///< bound of them
  float light_same = 0.1f;  ///< of the logarithm of radiance: twice what texture and gloss explain, as fusion assumes
  float visible_codes = 0.5f;  ///< of an 8-bit picture: less rounds to the camera's own code
  /// Part of a pixel's radiance: at most 0.22 of an 8-bit picture's steps, as 255 d sRGB / d ln(linear) is below 113.
  float visible_part = 1.0f / 512;
  float brighter = 1.5f;       ///< than before is surface in other light: more than texture between its pixels
  int uncovered_reach_px = 8;  ///< of a view: how far surface that it did not see is continued
  float even_part = 0.1f;      ///< of the depth that noise and voxels explain: within it two planes explain depth alike
  float least_open = 1.0f / 512;           ///< what layers leave of a camera ray: half a step of an 8-bit picture
  float thickness_m = 0.4f;                ///< of a person: what is nearer behind a surface may be its own side
  float recent_cell_m = 0.05f;             ///< of space where something moved,
  std::int64_t recent_ns = 3'000'000'000;  ///< within this time: fusion forgets what it sees gone in a second
  /// Measurements of settled surface: the six that fusion averages completely (UpdateSchedule), and the three of what
  /// was there before (BrickUpdateParameters::past_updates).
  float settled_updates = 9;
} kGather;
}  // namespace lumigraft::relight
