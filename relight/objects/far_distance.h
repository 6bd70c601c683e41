#pragma once
// Extends an object's distance field beyond the band in which it is exact, so that cones can take long steps.
#include <vector>

#include "relight/objects/distance_field.h"

namespace lumigraft::relight {

/// The field's distances; where they are clamped, a lower bound of the true distance that is at most 1.5 voxels too
/// small, with the field's sign (Felzenszwalb & Huttenlocher 2012, exact Euclidean transform of the surface voxels).
std::vector<float> full_distances(const ObjectField& field);

}  // namespace lumigraft::relight
