#pragma once
// Relative pose of two cameras, and their pose in the room.
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"

namespace lumigraft::reconstruct {

/// Pose of the second camera relative to the first.
struct ExtrinsicsCalibration {
  Eigen::Isometry3d T_second_first = Eigen::Isometry3d::Identity();
  Eigen::Vector3d turn_sigma_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift_sigma_m = Eigen::Vector3d::Zero();
  int moments = 0;      ///< at which both cameras saw the board
  double outliers = 0;  ///< fraction of the corners rejected by the joint adjustment
  double median_px = 0;
  std::string refusal;  ///< as CameraCalibration::refusal
};

/// `first_views` and `second_views` are indexed by moment; views may be empty. The lenses are free in the adjustment,
/// so that their uncertainty propagates.
ExtrinsicsCalibration calibrate_extrinsics(const capture::CameraModel& first, const capture::CameraModel& second,
                                           const std::vector<BoardView>& first_views,
                                           const std::vector<BoardView>& second_views);

/// Pose of a tag fixed in the room.
struct RoomTagPose {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  int pictures = 0;
  double median_px = 0;
  std::string refusal;
};

/// Estimates it from the tag's corners in pictures of one static camera, or of two, then in the frame of the second,
/// the fish-eye. `T_second_first` is empty where the cameras are not rigidly mounted; then the first camera's corners
/// are not used.
RoomTagPose place_room_tag(const capture::CameraModel& first, const capture::CameraModel& second,
                           const std::optional<Eigen::Isometry3d>& T_second_first,
                           const std::array<std::vector<SeenPoints>, 2>& seen);

}  // namespace lumigraft::reconstruct
