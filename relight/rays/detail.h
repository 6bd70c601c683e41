#pragma once
// How finely pixels are looked at, as the plan's trace_scale says.

namespace lumigraft::rays {

struct Detail {
  int gather = 2;     ///< edge of the squares of pixels that indirect light is gathered for, pixels
  int block = 1;      ///< likewise of those of the room that share lamps' shadows and indirect light
  int on_object = 1;  ///< likewise of those of objects that share lamps' shadows
  int step = 2;       ///< blocks between those that shadows are looked for at first
  int inside = 4;     ///< rays of a pixel in the middle of an object
  int at_edges = 16;  ///< and at its edge
  int rounds = 1;     ///< frames in which all that does not depend on the camera gets new light while things move

  bool operator==(const Detail&) const = default;
};

inline Detail detail_of(int trace_scale) {
  if (trace_scale < 4) return {trace_scale, 1, 1, 2, 4, 16, 1};
  return {trace_scale, trace_scale / 4, trace_scale / 2, 4, 1, trace_scale == 4 ? 8 : 4, 8};
}

}  // namespace lumigraft::rays
