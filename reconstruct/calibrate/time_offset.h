#pragma once
// By how much the second camera's clock is behind the first's, from a board that moves.
//
// The first camera's pictures give the board's path. At the times of the second camera's pictures, shifted by the
// offset, the path says where the board was, and the second camera's corners must be there: the offset and how the
// cameras stand to each other follow by least squares (Furgale et al. 2013, with a cubic through four poses in place of
// a spline). Lenses are known.
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"

namespace lumigraft::reconstruct {

/// What one camera saw of the board, still or moving.
struct TimedView {
  std::int64_t time_ns = 0;  ///< the picture's own
  BoardView view;
};

struct TimeOffsetCalibration {
  double offset_s = 0;  ///< to be added to the second camera's times
  double sigma_s = 0;   ///< 1σ
  int pictures = 0;     ///< of the second camera, between pictures of the first
  double speed_px = 0;  ///< how fast the board moved in them, pixels in a second, in the mean
  double median_px = 0;
  std::string refusal;  ///< why it is not to be used, on one line; empty where it is
};

TimeOffsetCalibration calibrate_time(const capture::CameraModel& first, const capture::CameraModel& second,
                                     const Eigen::Isometry3d& T_second_first, const std::vector<TimedView>& first_views,
                                     const std::vector<TimedView>& second_views);

}  // namespace lumigraft::reconstruct
