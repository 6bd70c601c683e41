#pragma once
// Correction of walls that are so bright that the fish-eye image clips on them.
#include <vector>

#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/light/light.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

/// Raises the clipped cells of the environment: to the radiance that the colour camera measured where the fish-eye's
/// ray hits known surface; else, on a measured side of the room, to the radiance that `lamps` cause at the albedo which
/// that side has where it is not clipped. Cells outside the view follow the nearest cells inside. Updates the spherical
/// harmonics.
void raise_clipped(Illumination& light, const std::vector<PointLight>& lamps, const Enclosure* room,
                   const DistanceField& field, const FieldRays& rays, const MetalMask& metal);

}  // namespace lumigraft::reconstruct
