#pragma once
// Planes in the surface of the room, as candidates for mirrors.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/room/enclosure.h"
#include "reconstruct/room/parameters.h"

namespace lumigraft::reconstruct {

/// A plane with its normal towards free space.
struct RoomPlane : MirrorPlane {
  float height_m(const Eigen::Vector3f& p) const { return normal.dot(p) + offset_m; }
  bool holds(const RoomPoint& p) const {
    return p.normal.dot(normal) > kRoomParameters.mirrors.same_plane_cosine &&
           std::abs(height_m(p.position_m)) < kRoomParameters.mirrors.plane_tolerance_m;
  }
  Eigen::Vector3f reflected(const Eigen::Vector3f& p) const { return p - 2 * height_m(p) * normal; }
};

/// Planes with at least kRoomParameters.mirrors.min_points_on_plane points, in the order of their first point.
std::vector<RoomPlane> planes_of(const std::vector<RoomPoint>& points);

}  // namespace lumigraft::reconstruct
