#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.
#include <cstdint>

namespace lumigraft::relight {
inline constexpr struct RelightParameters {
  int round_frames = 24, slices = 8, calm_frames = 60;  ///< of an amortized update; parts of a pass; planner's frames
  int jump_slices = 32;         ///< parts of a pass after a jump: on two cores without a GPU a part takes about 4 ms
  double max_frame_ms = 200;    ///< between frames: longer are interruptions
  double min_budget_ms = 1;     ///< of a frame for such parts, where time stamps do not advance
  double frame_fraction = 0.5;  ///< of the time between frames, for such parts: no frame takes twice as long
  /// Larger changes between two frames are jumps, which are shown at once instead of faded, or have a round of their
  /// own. Moves over an object's radius or a lamp's distance; 15°; light relative, of a lamp or of the residual
  /// environment.
  float max_move = 0.25f, max_turn_rad = 0.26f, max_scale = 0.02f, max_lamp_move = 0.1f, max_light = 0.25f;
  /// Publications of the field: a younger one still changes much; the volumes follow it after so many, and while fewer
  /// of its bricks than the fraction few_changed differ. Image motion of a static camera: objects have two samples or
  /// more per pixel and axis, so that an error of still_px changes the coverage by less than one.
  std::uint64_t young_field = 64, max_behind = 24, max_behind_few_changed = 64;
  double few_changed = 0.1, still_px = 0.125;
  /// Light for live pictures may take so many times their budget: at 30 Hz shadows of what moves are then 0.1 to 0.15 s
  /// late.
  double light_budgets = 4;
  /// Times what it took, light can wait while nothing but the camera moves, as long as the view that it was found for
  /// overlaps with that of now by so much: until it is 0.67 s old, errors of a moving camera's pictures grow by less
  /// than a tenth (tests/bench/late_light).
  double light_rest = 3;
  double max_light_rest_ms = 500;
  float min_overlap = 0.9f;
  float few_moved = 0.01f;   ///< of a view's pixels: noise of depth at edges shows so many as moved
  double hung_light_s = 10;  ///< pictures then wait for it, as the watchdog of a service does for them
  double rest_s = 1;         ///< without motion, until the camera counts as resting
  /// Of the quality ladder: times of the budget over which the step goes down, and under which the next one may take to
  /// go up; pictures that contain the change of step itself; all pictures over which a still scene is gathered anew
  /// (GatherQuality::rounds, twice for new objects); and those in a row that keep what was computed, until nothing
  /// moves.
  double over_budget = 1.1, under_budget = 0.8;
  int settling_pictures = 2, refining_pictures = 20, kept_pictures = 15;
  /// From a change of step to the next step up: at first; after a step down; and at most, doubling with each. One
  /// picture may take so long while nothing moves: it delays a reaction, which people notice from about that on.
  double first_wait_s = 2, next_wait_s = 10, max_wait_s = 80, max_pause_ms = 200;
  float max_left_out = 0.01f;  ///< of the irradiance; a choice is lowered if half of it would do for calm_frames
  int change_cones = 9, vertex_cones = 9;  ///< over the hemisphere of a real cell; of an object's vertex
  float min_hemisphere = 0.004f;  ///< covered by objects, for real cells to gather: less changes no 8-bit pixel value
  float max_voxel = 1;            ///< truncations: of coarser voxels some that a surface crosses have no distance
  float dim_pixel = 0.05f;        ///< linear pixel value of a dim surface, to compare with what objects emit
  float min_object_voxels = 6, min_depth_change = 0.02f;  ///< along its longest edge; of depth: more than noise
  int min_volume = 32, min_codes = 8, code_ratio = 8;  ///< voxels along an edge; noise of pixel values: least, of value
  int step_px = 2, min_changed_px = 2;                 ///< one of so many pixels along each axis; of a block
  float near_plane_m = 0.02f, min_still_m = 0.05f;     ///< of rendering; at which camera motion is measured
  float glossy_margin_m = 0.03f, sharp = 0.1f;         ///< of a box; GGX's alpha: sharper ones follow objects at once
} kRelight;
}  // namespace lumigraft::relight
