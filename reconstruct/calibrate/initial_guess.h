#pragma once
// A first guess of a lens and of where the board was, from nothing.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/bundle_adjustment.h"

namespace lumigraft::reconstruct {

/// Where the board is: the plane's homography to rays of any direction, read as a pose (Zhang 2000, §3.1). Empty where
/// fewer than four points are seen.
std::optional<Eigen::Isometry3d> board_pose(const BoardView& view, const capture::CameraModel& camera);

/// The same, by least squares through a lens that is known.
std::optional<Eigen::Isometry3d> refined_pose(const BoardView& view, const capture::CameraModel& camera);

/// `camera` has a kind and a size; its focal length is looked for among what lenses have, its principal point is taken
/// in the middle. Poses of all views, too. Empty where nothing explains them.
std::optional<Rig> start_camera(const capture::CameraModel& camera, const std::vector<BoardView>& views);

}  // namespace lumigraft::reconstruct
