#pragma once
// Placement of the volumes: two cascades around the virtual objects, and a tight box for the objects' distances.
#include <Eigen/Geometry>
#include <vector>

#include "relight/exhibit/exhibit.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

struct BoundingSphere {
  Eigen::Vector3f centre_m = Eigen::Vector3f::Zero();
  float radius_m = 0;

  bool operator==(const BoundingSphere&) const = default;
};

/// Centred on the bounding box.
BoundingSphere bounding_sphere(const std::vector<Eigen::Vector3f>& points_m);

struct PlacedBounds {
  BoundingSphere sphere;    ///< in the tag frame
  Eigen::AlignedBox3f box;  ///< in the tag frame
  float emission = 0;       ///< of its brightest material and channel, as in Material
};

struct Placement {
  shader::vec4 cascade[2];  ///< centre of voxel (0, 0, 0), voxel size; tag frame
  shader::vec4 virtual_grid;
  Eigen::Vector3i virtual_size;
  BoundingSphere sphere;  ///< around all objects

  bool operator==(const Placement&) const = default;
};

/// Cascade 0 is a cube of 1.3 times the sphere's diameter, cascade 1 one of 3.5 times cascade 0's edge. Where objects
/// emit cascade 1 is larger, as far as this light is a visible part of the picture's white, but its voxels are at most
/// `max_voxel_m`. Both are snapped to their own voxel grid, to avoid swimming artifacts while objects move. The virtual
/// volume has the longest edge of the objects' box plus a margin of three voxels.
Placement place_volumes(const std::vector<PlacedBounds>& objects, int voxels, float max_voxel_m);

}  // namespace lumigraft::relight
