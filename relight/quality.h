#pragma once
// What the plan leaves to be derived from it.
#include "relight/plan.h"

namespace lumigraft::relight {

struct Quality {
  float
      min_code_change;   ///< code values by which the objects must be able to change a pixel, at the most careful bound
  int delta_cones;       ///< aimed at the objects, per real pixel; unused with `cells`
  int change_cones;      ///< over the hemisphere of real pixels, for the change of other real surfaces; likewise
  int hemisphere_cones;  ///< over the hemisphere of virtual surfaces
  int shadow_cones;      ///< per lamp
  int lamp_maps;         ///< points of all lamps together from which shadows are drawn
  int lamp_map_edge;     ///< texels along the edge of such a map
  int shadow_scale;      ///< shadows on surfaces without known gloss are traced at 1/shadow_scale of the picture
  int ambient_scale;     ///< light on virtual surfaces but for the lamps is traced at 1/ambient_scale of the picture
  int glossy_cones;      ///< per mirror lobe
  int voxel_cones;       ///< per voxel and bounce
  int window;            ///< half the window of the filter of traced light, in traced pixels; likewise
  int supersampling;     ///< of the object's silhouette, along each axis
  bool simple_models;    ///< draw simplified triangles to the camera too, and still simpler ones to lamps
  bool cells;  ///< take the indirect change of real pixels from the cells of the volumes, not traced per pixel
};

/// Full resolution is the careful setting; coarser tracing goes with fewer cones. 9 is the least that covers a
/// hemisphere evenly (Crassin et al. 2011 use 5 to 9).
inline Quality quality_of(const Plan& plan) {
  if (plan.quality) return *plan.quality;
  if (plan.in_cells() && plan.trace_scale < 4) return {1.0f, 0, 0, 20, 6, 32, 256, 1, 1, 16, 12, 0, 2, false, true};
  switch (plan.trace_scale) {
    case 1:
      return {0.5f, 16, 9, 32, 16, 64, 256, 1, 1, 24, 16, 2, 4, false, false};
    case 2:
      return {0.5f, 20, 9, 20, 6, 32, 256, 1, 1, 16, 12, 2, 2, false, false};
    default:
      return {3.0f, 0, 0, 6, 4, 12, 128, 2, 2, 4, 6, 0, 2, true, true};
  }
}

/// Whether the last bounce ends in cells by cones, whose noise is smoothed between them.
inline bool smooths_cells(const Plan& plan) { return quality_of(plan).cells && plan.method != "dlpv"; }

/// Over the hemisphere of real cells, for the change of other real surfaces.
constexpr int kChangeCones = 9;

/// Real cells whose hemisphere the objects fill by less do not gather: their change is below a code value.
constexpr float kLeastShare = 0.004f;

}  // namespace lumigraft::relight
