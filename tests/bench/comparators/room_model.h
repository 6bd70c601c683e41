#pragma once
// The true room as a model, for renderers of virtual objects.
#include <memory>

#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// The part of the room inside a box, with triangle edges up to `longest_m` and diffuse albedo per vertex. Mirrors
/// other than known surfaces become diffuse. Triangles of different planes are separated by a hundredth of a millimetre
/// and share no vertex: otherwise the walls of a closed room would count as the outside of a solid.
std::shared_ptr<const relight::Model> room_model(const relight::TraceWorld& world, const Eigen::AlignedBox3f& box,
                                                 float longest_m);

}  // namespace lumigraft::comparators
