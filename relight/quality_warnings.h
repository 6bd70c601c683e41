#pragma once
// Where a frame asks for more than the methods hold, they come near: this says so, for the frame's warnings.
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/objects/placement.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// One line for each thing that is approximate: triangles that were left out or taken together; lamps so near or inside
/// the objects that shadows of theirs come from voxels; objects that are few voxels long because others are far away; a
/// camera inside an object's bounds, from where the volumes show it coarsely.
std::vector<std::string> quality_warnings(const Exhibit& exhibit, const std::vector<PlacedObject>& objects,
                                          const Placement& placement, const reconstruct::Scene& scene);

/// The line about an object's triangles that could not be used, if there are any; every renderer says it.
std::optional<std::string> left_out(const VirtualObject& object);

}  // namespace lumigraft::relight
