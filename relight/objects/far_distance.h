#pragma once
// Distances of an object's field beyond the band in which they are exact, so that cones can take long steps.
#include <vector>

#include "relight/objects/distance_field.h"

namespace lumigraft::relight {

/// The field's distances; where they are clamped, a lower bound of the true distance that is at most 1.5 voxels short,
/// with the field's sign (Felzenszwalb & Huttenlocher 2012, exact Euclidean transform of the voxels at the surface).
std::vector<float> full_distances(const ObjectField& field);

}  // namespace lumigraft::relight
