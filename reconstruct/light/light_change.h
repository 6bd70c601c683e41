#pragma once
// How much the measured light of the room changed.
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Sum of the changes of all lamps' irradiance vectors at the probe and of the environment's mean irradiance, over all
/// irradiance of the two. Lamps are matched by id; one without a counterpart counts whole. A turned lamp counts by the
/// change of its vector. 0 to 2.
double relative_change(const Illumination& now, const Illumination& before);

}  // namespace lumigraft::reconstruct
