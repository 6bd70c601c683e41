#pragma once
// How two cameras stand to each other, and where they stand in the room.
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"

namespace lumigraft::reconstruct {

/// How a second camera stands to the first.
struct ExtrinsicsCalibration {
  Eigen::Isometry3d T_second_first = Eigen::Isometry3d::Identity();
  Eigen::Vector3d turn_sigma_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift_sigma_m = Eigen::Vector3d::Zero();
  int moments = 0;      ///< at which both saw the board
  double outliers = 0;  ///< share of the corners that are not where both cameras together put them
  double median_px = 0;
  std::string refusal;  ///< as CameraCalibration::refusal
};

/// `first_views` and `second_views` hold what each camera saw, by moment; views may be empty. Lenses are free to give
/// way, so that what is not known of them counts in the uncertainty.
ExtrinsicsCalibration calibrate_stand(const capture::CameraModel& first, const capture::CameraModel& second,
                                      const std::vector<BoardView>& first_views,
                                      const std::vector<BoardView>& second_views);

/// Where a tag that hangs in the room is.
struct RoomTagPose {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  int pictures = 0;
  double median_px = 0;
  std::string refusal;
};

/// The tag's corners in pictures of one camera that stands still, or of two that do: then in the frame of the second,
/// the fish-eye. `stand` is empty where they do not stand still to each other, and the first camera's say nothing.
RoomTagPose place_room_tag(const capture::CameraModel& first, const capture::CameraModel& second,
                           const std::optional<Eigen::Isometry3d>& T_second_first,
                           const std::array<std::vector<SeenPoints>, 2>& seen);

}  // namespace lumigraft::reconstruct
