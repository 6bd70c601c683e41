#pragma once
// Settings of Franke 2015, section 5.4, tables 5.6 and 5.7: 256³ voxels, one bounce; per pixel nine diffuse cones, one
// mirror cone, one cone per lamp, no filtering.
#include <memory>

#include "relight/plan.h"
#include "relight/quality.h"

namespace lumigraft::comparators {

/// `supersampling`: samples per pixel along each axis, of objects.
inline relight::Plan thesis_plan(int supersampling) {
  relight::Plan plan;
  plan.method = "dvct";
  plan.volume = 256;
  plan.trace_scale = 1;
  plan.rsm = 1024;
  plan.bounces = 1;
  plan.quality = std::make_shared<relight::Quality>(relight::Quality{.min_code_change = 0.5f,
                                                                     .delta_cones = 9,
                                                                     .change_cones = 9,
                                                                     .hemisphere_cones = 9,
                                                                     .shadow_cones = 1,
                                                                     .lamp_maps = 0,
                                                                     .lamp_map_edge = 256,
                                                                     .shadow_scale = 1,
                                                                     .ambient_scale = 1,
                                                                     .glossy_cones = 1,
                                                                     .voxel_cones = 9,
                                                                     .window = 0,
                                                                     .supersampling = supersampling,
                                                                     .simple_models = false,
                                                                     .cells = false});
  return plan;
}

}  // namespace lumigraft::comparators
