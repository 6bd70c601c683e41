#pragma once
// What the plan leaves to be derived from it.
#include "relight/plan.h"

namespace lumigraft {

struct Quality {
  int delta_cones;       ///< aimed at the objects, per real pixel
  int hemisphere_cones;  ///< over the hemisphere of virtual surfaces
  int shadow_cones;      ///< per lamp
  int glossy_cones;      ///< per mirror lobe
  int voxel_cones;       ///< per voxel and bounce
  int window;            ///< half the filter's window, in traced pixels
  int supersampling;     ///< of the object's silhouette, along each axis
  bool simple_models;    ///< draw simplified triangles to the camera too
};

/// Full resolution is the careful setting; coarser tracing goes with fewer cones. 9 is the least that covers a
/// hemisphere evenly (Crassin et al. 2011 use 5 to 9).
inline Quality quality_of(const Plan& plan) {
  switch (plan.trace_scale) {
    case 1:
      return {40, 48, 16, 32, 16, 2, 4, false};
    case 2:
      return {20, 20, 6, 16, 12, 2, 2, false};
    default:
      return {12, 9, 3, 8, 9, 1, 2, true};
  }
}

/// Real voxels whose hemisphere the objects fill by less do not gather: their change is below a code value.
constexpr float kLeastShare = 0.004f;

}  // namespace lumigraft
