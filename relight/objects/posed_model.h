#pragma once
// A model in a pose of its rig. Nothing but its vertices' positions, normals and tangents differs from the model at
// rest, so that what depends on topology, textures or colours alone holds for all poses.
#include <memory>

#include "relight/animation/skinning.h"
#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The vertices of a model that was simplified, subdivided or cut stay those of the model it was made of: points of its
/// triangles. `rig`: of the model's rig, which it must have. Normals without a direction and
/// positions that are not finite stay at rest.
std::shared_ptr<const Model> posed_model(const Model& model, const PosedVertices& rig);

/// The same for a pose; the model itself at rest.
std::shared_ptr<const Model> posed_model(const std::shared_ptr<const Model>& model, const RigPose& pose);

}  // namespace lumigraft::relight
