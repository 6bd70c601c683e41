#pragma once
// The camera's pose from depth alone: against the room's surface, and against the picture before.
#include <Eigen/Geometry>
#include <optional>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {

struct PoseEstimate {
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
  PoseCovariance covariance = PoseCovariance::Zero();
};

struct SurfaceFit {
  PoseEstimate pose;
  double shared = 0;  ///< of the points measured, the share that lies on the known surface
};

/// Frame-to-model ICP, point to plane: the distance field is the distance of a point to the plane next to it, and its
/// gradient that plane's normal, so no neighbours are searched (Bylow et al. 2013, "Real-time camera tracking and 3D
/// reconstruction using signed distance functions", eq. 8-14, with robust weights). What surfaces do not tell stays
/// as `expected` says. Reaches as far as the field's truncation. Empty where too few points lie on the known surface.
std::optional<SurfaceFit> align_to_field(const DepthGrid& grid, const DistanceField& field,
                                         const PoseEstimate& expected);

/// Projective point-to-plane ICP against an earlier picture (Rusinkiewicz & Levoy 2001; Newcombe et al. 2011, §3.5):
/// less exact, but it reaches decimetres. Never worse than `expected` where pictures share too little.
Eigen::Isometry3d align_to_picture(const DepthGrid& grid, const DepthGrid& earlier, const capture::CameraModel& camera,
                                   const Eigen::Isometry3d& earlier_T_tag_camera, const PoseEstimate& expected);

}  // namespace lumigraft::reconstruct
