#pragma once
// Detection of mirrors at whose own surface depth is measured, as on polished metal. Where depth cameras measure
// through a mirror, see mirror_detection.h.
//
// The colours of such a plane are the reflection of what is in front of it. Observed radiance of its points is
// regressed on that of the known surface that the reflected viewing ray hits: its luminance, and its colour differences
// (red and blue against green). Both must be explained, since each alone has another cause: a shadow that continues
// from a floor onto a wall is symmetric about their edge, but has no hue; light reflected diffusely from coloured walls
// has little slope. A trend over the plane (second order) is removed first, and the luminance from the differences.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

/// Of a regression through the origin.
struct Regression {
  float slope = 0, correlation = 0;
};

struct ReflectingPlane {
  MirrorPlane plane;                                   ///< its normal towards the cameras
  Eigen::Vector3f middle_m = Eigen::Vector3f::Zero();  ///< mean of the points at which known surface is reflected
  int points = 0;                                      ///< number of these
  Regression luminance, hue;                           ///< observed on reflected; the slopes estimate the reflectance
};

/// Planes whose colours are mostly reflection, without those that the session states as metal. `points`:
/// room_points(field).
std::vector<ReflectingPlane> find_reflecting_planes(const std::vector<RoomPoint>& points, const DistanceField& field,
                                                    const MetalMask& metal);

}  // namespace lumigraft::reconstruct
