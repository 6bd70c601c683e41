#pragma once
// Settings derived from the plan.
#include "relight/plan.h"

namespace lumigraft::relight {

struct Quality {
  float min_code_change;  ///< pixel values (8 bit), conservative, by which the objects must change a pixel
  int delta_cones;        ///< cones towards the objects, per real pixel; unused with `cells`
  int change_cones;       ///< cones over the hemisphere of real pixels, for other real surfaces; unused with `cells`
  int hemisphere_cones;   ///< cones over the hemisphere of virtual surfaces
  int shadow_cones;       ///< per lamp
  int lamp_maps;          ///< light sample points with a shadow map, all lamps together
  int lamp_map_edge;      ///< texels along the edge of such a shadow map
  int shadow_scale;       ///< shadows on surfaces of unknown gloss are traced at 1/shadow_scale of the image size
  int ambient_scale;      ///< light on virtual surfaces except lamps is traced at 1/ambient_scale of the image size
  int glossy_cones;       ///< per mirror lobe
  int voxel_cones;        ///< per voxel and bounce
  int window;             ///< half width of the filter of traced light, in traced pixels; unused with `cells`
  int supersampling;      ///< samples per pixel along each axis, for object silhouettes
  bool simple_models;     ///< render simplified meshes to the camera too, and coarser ones to lamps
  bool cells;  ///< take the indirect change of real pixels from cells of the volumes instead of tracing it per pixel
};

/// Full resolution is the highest setting; coarser tracing uses fewer cones. 9 is the minimum that covers a hemisphere
/// evenly (Crassin et al. 2011 use 5 to 9).
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

/// Whether the last bounce is gathered in cells by cones, whose noise is filtered between cells.
inline bool smooths_cells(const Plan& plan) { return quality_of(plan).cells && plan.method != "dlpv"; }

}  // namespace lumigraft::relight
