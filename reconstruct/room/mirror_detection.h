#pragma once
// Mirrors that nobody named. A depth camera measures through them: what they reflect is fused as a second room behind
// the wall that they hang on.
//
// A plane of the room through which things were seen is taken for one with a mirror in it where those things are the
// reflection of what stands before it: reflected back they lie on known surfaces, the same way round, and hardly ever
// in space that cameras saw to be free. Behind an opening stands a room of its own, and most of it falls into free
// space.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

struct DetectedMirror {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();   ///< unit, to where cameras are; tag frame
  Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  ///< of where its reflections are seen through the plane
  int confirmed = 0, denied = 0;                       ///< points behind it that are reflections, or cannot be
};

/// `points` are the field's own (room_points). Those with most points first; empty where nothing looks like a mirror.
std::vector<DetectedMirror> suspected_mirrors(const std::vector<RoomPoint>& points, const DistanceField& field);

/// A line for each.
std::vector<std::string> mirror_warnings(const std::vector<RoomPoint>& points, const DistanceField& field);

}  // namespace lumigraft::reconstruct
