#pragma once
// Camera pose from depth by ICP: against the distance field, and against an earlier depth image.
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
  double inlier_fraction = 0;  ///< measured points on the known surface
};

/// Frame-to-model ICP, point to plane. The field gives a point's distance to the nearest plane, and its gradient that
/// plane's normal, so there is no search for neighbours (Bylow et al. 2013, "Real-time camera tracking and 3D
/// reconstruction using signed distance functions", eq. 8-14, with robust weights). `expected` is a prior: directions
/// that surfaces do not determine keep its values and its variance; the covariance contains errors that the noise model
/// does not, as far as they differ between parts of the image. Iterations begin at `start`, else at `expected`. Reaches
/// as far as the field's truncation distance. Empty if too few points are on the known surface.
std::optional<SurfaceFit> align_to_field(const DepthGrid& grid, const DistanceField& field,
                                         const PoseEstimate& expected,
                                         const std::optional<Eigen::Isometry3d>& start = std::nullopt);

/// -2 ln of a pose's posterior up to a constant, with the prior `expected`; points without surface near them count as
/// the least likely ones. Tells which of several fits to the same points is right.
double surface_cost(const DepthGrid& grid, const DistanceField& field, const PoseEstimate& expected,
                    const Eigen::Isometry3d& pose);

/// Projective point-to-plane ICP against an earlier depth image (Rusinkiewicz & Levoy 2001; Newcombe et al. 2011,
/// §3.5): less exact, but with a reach of decimetres. Returns the pose of `expected` if the images have too little in
/// common.
Eigen::Isometry3d align_to_frame(const DepthGrid& grid, const DepthGrid& earlier, const capture::CameraModel& camera,
                                 const Eigen::Isometry3d& earlier_T_tag_camera, const PoseEstimate& expected);

}  // namespace lumigraft::reconstruct
