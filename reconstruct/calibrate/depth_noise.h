#pragma once
// Noise of a depth camera, from boards: a plane's inverse depth is affine in the image, so what is left of it is noise.
#include <Eigen/Geometry>
#include <vector>

#include "capture/camera/depth_noise.h"
#include "reconstruct/calibrate/depth.h"

namespace lumigraft::reconstruct {

struct DepthNoiseCalibration {
  double scale = 1;                 ///< noise over that of capture::usual_noise; the median of the views
  int views = 0;                    ///< with enough depth on the board; 0: not measured
  double nearest_m = 0, far_m = 0;  ///< depths of the boards
};

DepthNoiseCalibration measure_depth_noise(const capture::CameraModel& depth, capture::DepthPrinciple principle,
                                          const Eigen::Isometry3d& T_color_depth, const Board& board,
                                          const std::vector<BoardDepthView>& views);

}  // namespace lumigraft::reconstruct
