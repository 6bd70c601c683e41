#pragma once
// Surfaces that a [[real_surface]] of the session names: triangles of their meshes, their signed distance fields, and
// where they are metal.
#include <Eigen/Core>
#include <array>
#include <unordered_set>
#include <utility>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

using SurfaceTriangle = std::array<Eigen::Vector3f, 3>;

/// Vertices in metres in the tag frame, as in the file. Throws InputError.
std::vector<SurfaceTriangle> read_triangles(const capture::RealSurface& surface);

/// Signed distances to the nearest triangle, up to `band_m`. Positive on the side from which its corners are in
/// counter-clockwise order. Points beyond the border of an open mesh stay unknown.
DistanceField field_of(const std::vector<SurfaceTriangle>& triangles, float voxel_m, float band_m);

/// Barycentric weights of the triangle's point nearest to the origin, by the Voronoi region that contains the origin
/// (Ericson 2005, "Real-Time Collision Detection", §5.1.5).
Eigen::Vector3f nearest_to_origin(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

/// Points p of the tag frame with normal · p + offset_m = 0.
struct MirrorPlane {
  Eigen::Vector3f normal;  ///< unit
  float offset_m = 0;
};

/// Surfaces that the session declares as metal, and planes that were found to be mirrors: they have no diffuse albedo,
/// and their radiance depends on the camera position.
class MetalMask {
 public:
  /// Reads the meshes of real surfaces with metallic >= 0.5. Throws InputError.
  explicit MetalMask(const capture::Session& session);

  /// In place of the earlier ones.
  void set_mirrors(std::vector<MirrorPlane> planes) { mirrors_ = std::move(planes); }

  /// Whether metal is within about 1.5 voxels of the point (tag frame), or it is on a mirror's whole plane. The area of
  /// the tag is paper, never metal.
  bool contains(const Eigen::Vector3f& position_m) const;

 private:
  BrickKey cell(const Eigen::Vector3f& position_m) const;

  double tag_reach_m_;                                ///< half the edge of the tag's paper
  std::unordered_set<BrickKey, BrickKeyHash> cells_;  ///< cells that contain metal
  std::vector<MirrorPlane> mirrors_;
};

}  // namespace lumigraft::reconstruct
