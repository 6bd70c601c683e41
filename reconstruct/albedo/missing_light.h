#pragma once
// Light that falls on the room but is not in the fish-eye's image, as of a lamp that an object occludes from it.
#include <vector>

#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// What surfaces reflect over what they can under the modelled light, 1 at most if that is complete: of white paper,
/// over all that lamps would give it if nothing occluded them; without paper of the median sample, whose albedo is
/// taken as 1. 0 if nothing was measured. `light`: of the samples of `surface`; `print_m`: edge of the tag's paper.
float reflected_over_possible(const Surface& surface, const std::vector<SampleLight>& light,
                              const IrradianceModel& room, const Illumination& illumination, double print_m);

}  // namespace lumigraft::reconstruct
