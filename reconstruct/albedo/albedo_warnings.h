#pragma once
// Warnings about light and albedo that the solution does not determine.
#include <string>
#include <vector>

#include "reconstruct/lamps/lamp_placement.h"
#include "reconstruct/light/extrinsics_check.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

inline constexpr const char* kNoSurface =
    "no surface of the room is known: the depth frames contain no measurements, or none within range";

/// About distances, beams and powers of lamps, in this order; `estimates`: of those lamps that have one.
std::vector<std::string> lamp_warnings(const std::vector<PointLight>& lamps,
                                       const std::vector<LampEstimate>& estimates);
std::string extrinsics_warning(const ExtrinsicsError& error);

}  // namespace lumigraft::reconstruct
