#pragma once
// Lamps from one fish-eye picture to the next: who is who, and averaging while nothing moves.
#include <memory>

#include "reconstruct/light.h"

namespace lumigraft {

/// Gives the lamps of `now` the ids of the nearest lamps of `last` (new ones where none is near), and averages the two
/// while the light stands still, lamps and remainder alike, so that they still sum to an (averaged) picture.
class LightTracker {
 public:
  void update(const Illumination* last, Illumination& now);
  void reset();

 private:
  int next_id_ = 0;
  int averaged_ = 0;  ///< pictures in the running mean
};

}  // namespace lumigraft
