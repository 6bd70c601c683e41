#pragma once
// The pose of a rig at a time of an animation.
#include <cstddef>

#include "relight/animation/rig.h"

namespace lumigraft::relight {

/// Of the nodes as the file places them.
RigPose rest_pose(const Rig& rig);

/// `animation`: its index in the rig. Nodes and weights that have no channel stay at rest.
RigPose pose_at(const Rig& rig, std::size_t animation, double time_s);

/// Whether a pose leaves anything to draw: its bones are finite, and not all of them shrink to a point.
bool has_extent(const RigPose& pose);

}  // namespace lumigraft::relight
