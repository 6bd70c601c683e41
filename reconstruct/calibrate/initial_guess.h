#pragma once
// Initial values of a lens and of board poses for bundle adjustment.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/bundle_adjustment.h"

namespace lumigraft::reconstruct {

/// The board's pose from the homography between its plane and rays in any direction (Zhang 2000, §3.1). Empty with
/// fewer than four points.
std::optional<Eigen::Isometry3d> board_pose(const BoardView& view, const capture::CameraModel& camera);

/// The same, refined by least squares with a known lens.
std::optional<Eigen::Isometry3d> refined_pose(const BoardView& view, const capture::CameraModel& camera);

/// `camera` gives kind and size. Searches the focal length over the usual range with the principal point in the centre,
/// and computes the poses of all views. Empty where no focal length fits.
std::optional<Rig> start_camera(const capture::CameraModel& camera, const std::vector<BoardView>& views);

}  // namespace lumigraft::reconstruct
