#pragma once
// Surfaces so bright that the fish-eye's picture clips on them.
#include <vector>

#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/metal_mask.h"
#include "reconstruct/light/light.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

/// Raises cells of the environment that are marked as clipped: to the radiance that the colour camera measured where
/// the fish-eye's ray meets known surface; else, on a measured side of the room, to what `lamps` make of a surface of
/// the albedo that this side shows where it is not clipped. Cells that no camera saw follow those nearest to them, as
/// before. The harmonics are those of the result.
void raise_clipped(Illumination& light, const std::vector<PointLight>& lamps, const Enclosure* room,
                   const DistanceField& field, const FieldRays& rays, const MetalMask& metal);

}  // namespace lumigraft::reconstruct
