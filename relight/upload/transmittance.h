#pragma once
// What passes transmissive objects, for devices: materials for the light at their pixels, and the fraction of the light
// that their shadows keep.
#include <vector>

#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// Of uniform light that falls on a convex object, the fraction that leaves it again by its interfaces other than
/// reflected at once; `chord_m`: mean path through its volume, of the model.
Eigen::Array3f transmittance_of(const Material& material, float chord_m);

/// Whether light passes any of the object's parts.
bool transmits(const PlacedObject& object);

/// The number of each object's Glass + 1; 0: opaque. Those beyond the last one share it.
std::vector<int> glass_numbers(const std::vector<PlacedObject>& objects);

/// Writes FrameParams::glass and blocked. An object's Glass is that of its first transmissive part; what objects block
/// is their mean, weighted by area.
void describe_glass(const std::vector<PlacedObject>& objects, shader::FrameParams& params);

}  // namespace lumigraft::relight
