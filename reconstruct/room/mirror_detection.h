#pragma once
// Detection of mirrors that the session does not name. A depth camera measures through a mirror: its reflection is
// fused as a second room behind the wall.
//
// A plane is taken for a wall with a mirror if the surface seen through it is the reflection of what is in front of it:
// reflected back it lies on known surface with the same normal, and hardly ever in observed free space. Behind a real
// opening is another room, most of which falls into free space.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "reconstruct/room/enclosure.h"
#include "reconstruct/room/reflected_colors.h"

namespace lumigraft::reconstruct {

struct DetectedMirror {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();   ///< unit, towards the cameras; tag frame
  Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  ///< mean of where rays to its reflections cross the plane
  int confirmed = 0, contradicted = 0;                 ///< points behind it that are, or cannot be, reflections
};

/// `points`: room_points(field). Mirrors with the most confirmed points first.
std::vector<DetectedMirror> find_mirrors(const std::vector<RoomPoint>& points, const DistanceField& field);

/// One line per mirror, found in depth and of `reflecting`.
std::vector<std::string> mirror_warnings(const std::vector<RoomPoint>& points, const DistanceField& field,
                                         const std::vector<ReflectingPlane>& reflecting);

}  // namespace lumigraft::reconstruct
