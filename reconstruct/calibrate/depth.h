#pragma once
// Pose of a depth camera relative to the colour camera, from boards that both see: the depth camera's points on a board
// must lie on the plane that the colour camera measures (Zhang & Zhang 2011, "Calibration between depth and color
// sensors for commodity depth cameras", eq. 6). The depth camera's lens is known.
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/calibrate/board.h"

namespace lumigraft::reconstruct {

struct BoardDepthView {
  const capture::Image<float>* depth_m =
      nullptr;  ///< on the depth camera's own pixels, along its z; 0 = no measurement
  Eigen::Isometry3d T_color_board;
};

struct DepthCalibration {
  Eigen::Isometry3d T_color_depth = Eigen::Isometry3d::Identity();
  Eigen::Vector3d turn_sigma_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift_sigma_m = Eigen::Vector3d::Zero();
  int views = 0;        ///< with enough depth on the board
  double median_m = 0;  ///< of the points' distances from the board's plane
  std::string refusal;  ///< why it is rejected, on one line; empty where accepted
};

/// `start` must be accurate to some centimetres and degrees.
DepthCalibration calibrate_depth(const capture::CameraModel& depth, const Eigen::Isometry3d& start, const Board& board,
                                 const std::vector<BoardDepthView>& views);

}  // namespace lumigraft::reconstruct
