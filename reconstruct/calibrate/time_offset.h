#pragma once
// Time offset between two cameras' clocks, from a moving board.
//
// The first camera's pictures give the board's trajectory. Evaluated at the times of the second camera's pictures plus
// the offset, it predicts the second camera's corners; the offset and the relative camera pose follow by least squares
// (Furgale et al. 2013, with a cubic through four poses instead of a spline). Lenses are known.
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"

namespace lumigraft::reconstruct {

/// One camera's view of the board, static or moving.
struct TimedView {
  std::int64_t time_ns = 0;  ///< the picture's timestamp
  BoardView view;
};

struct TimeOffsetCalibration {
  double offset_s = 0;  ///< add to the second camera's timestamps
  double sigma_s = 0;   ///< 1σ
  int pictures = 0;     ///< of the second camera, between pictures of the first
  double speed_px = 0;  ///< mean speed of the board in them, px/s
  double median_px = 0;
  std::string refusal;  ///< why it is rejected, on one line; empty where accepted
};

TimeOffsetCalibration calibrate_time(const capture::CameraModel& first, const capture::CameraModel& second,
                                     const Eigen::Isometry3d& T_second_first, const std::vector<TimedView>& first_views,
                                     const std::vector<TimedView>& second_views);

}  // namespace lumigraft::reconstruct
