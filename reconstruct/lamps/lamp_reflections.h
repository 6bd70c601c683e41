#pragma once
// Lamps that are none: mirror images of a lamp on a surface that the colour camera saw without them.
#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A lamp all of whose disk lies behind a known surface that is much darker than it, seen by the colour camera, is a
/// reflection: it goes back into the environment. A lamp that the colour camera sees itself is clipped there, so that
/// the field holds no radiance for it.
Illumination without_reflections(const Illumination& illumination, const DistanceField& field, const FieldRays& rays);

}  // namespace lumigraft::reconstruct
