#pragma once
// How finely pixels are looked at, as the plan's trace_scale says.

namespace lumigraft::rays {

struct Detail {
  int gather = 2;      ///< edge of the squares of pixels that indirect light is gathered for, pixels
  int block = 1;       ///< likewise of those of the room that share lamps' shadows and indirect light
  int on_object = 1;   ///< likewise of those of objects that share lamps' shadows
  int step = 2;        ///< blocks between those that shadows are looked for at first
  int lamp_rays = 16;  ///< of a block, to each lamp
  int inside = 4;      ///< rays of a pixel in the middle of an object
  int at_edges = 16;   ///< and at its edge
  int mirrored = 4;    ///< rays that a glossy object sends on for each of those inside
  int rounds = 1;      ///< frames in which all that does not depend on the camera gets new light while things move

  bool operator==(const Detail&) const = default;
};

inline Detail detail_of(int trace_scale) {
  switch (trace_scale) {
    case 8:
      return {8, 2, 4, 4, 8, 1, 4, 2, 8};
    case 4:
      return {4, 1, 2, 4, 16, 1, 8, 4, 8};
    default:
      return {trace_scale, 1, 1, 2, 16, 4, 16, 4, 1};
  }
}

}  // namespace lumigraft::rays
