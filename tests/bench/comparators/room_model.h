#pragma once
// The true room as a model, so that what draws virtual objects can draw all of it.
#include <memory>

#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// What of the room lies in a box, in triangles with no edge longer than `longest_m`, with the albedo that their
/// vertices show. Mirrors other than known surfaces lose their gloss. Triangles of different planes share no vertex, by
/// a hundredth of a millimetre: or the walls of a closed room would count as the outside of a solid.
std::shared_ptr<const relight::Model> room_model(const relight::TraceWorld& world, const Eigen::AlignedBox3f& box,
                                                 float longest_m);

}  // namespace lumigraft::comparators
