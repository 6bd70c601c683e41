#pragma once
// How finely pixels are looked at, as the plan's trace_scale says.

namespace lumigraft::relight {

struct GatherQuality {
  int gather = 2;       ///< edge of the squares of pixels that indirect light is gathered for, pixels
  int block = 1;        ///< likewise of those of the room that share lamps' shadows and indirect light
  int on_object = 1;    ///< likewise of those of objects that share lamps' shadows
  int step = 2;         ///< blocks between those that shadows are looked for at first
  int lamp_rays = 16;   ///< of a block, to each lamp
  bool sparse = false;  ///< one of 2 × 2 blocks tells of penumbrae that are wide
  int inside = 4;       ///< rays of a pixel in the middle of an object
  int at_edges = 16;    ///< and at its edge
  int mirrored = 4;     ///< rays that a glossy object sends on for each of those inside
  int rounds = 1;       ///< frames in which all that does not depend on the camera gets new light while things move

  bool operator==(const GatherQuality&) const = default;
};

inline GatherQuality gather_quality_of(int trace_scale) {
  switch (trace_scale) {
    case 8:
      return {.gather = 8,
              .block = 2,
              .on_object = 4,
              .step = 4,
              .lamp_rays = 8,
              .sparse = true,
              .inside = 1,
              .at_edges = 4,
              .mirrored = 2,
              .rounds = 8};
    case 4:
      return {
          .gather = 4, .block = 1, .on_object = 2, .step = 4, .sparse = true, .inside = 1, .at_edges = 8, .rounds = 8};
    default:
      return {.gather = trace_scale};
  }
}

}  // namespace lumigraft::relight
