#pragma once
// Warnings for a frame that cannot be relit, or that exceeds what the methods represent exactly.
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/objects/placement.h"
#include "relight/renderer.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// What a frame lacks to be relit; empty if nothing. `preparing`: names of visible objects that are not ready to be
/// drawn; `any_object`: whether others are visible. `room_given`: light and geometry are not those of the scene.
std::string what_is_missing(const reconstruct::Scene& scene, bool any_object,
                            const std::vector<std::string>& preparing = {}, bool room_given = false);

/// The line about such objects.
std::string being_prepared(const std::vector<std::string>& preparing);

/// For a result that is the camera's picture: says why.
void pass_through(const std::string& why, RelitPicture* result);

/// One line per approximation: triangles left out or merged; lamps so near to or inside the objects that their shadows
/// are traced through voxels; objects only a few voxels long because others are far away; a camera inside an object's
/// bounds, where the volumes represent it coarsely.
std::vector<std::string> quality_warnings(const Exhibit& exhibit, const std::vector<PlacedObject>& objects,
                                          const Placement& placement, const reconstruct::Scene& scene);

/// The lines about what an object lacks of its model file, if anything.
std::vector<std::string> left_out(const VirtualObject& object);
/// The same of all visible objects, and that others are being prepared, as warnings of a result.
void warn_of_objects(const Exhibit& exhibit, const std::vector<std::string>& preparing, RelitPicture* result);

}  // namespace lumigraft::relight
