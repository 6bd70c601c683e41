#pragma once
// Intrinsic calibration of one camera from pictures of a board.
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"
#include "reconstruct/calibrate/bundle_adjustment.h"
#include "reconstruct/calibrate/coverage.h"

namespace lumigraft::reconstruct {

/// A selected picture and its detected board points.
struct BoardPicture {
  capture::Image<std::uint16_t> light;
  BoardView view;
};

struct CameraCalibration {
  capture::CameraModel model;
  LensNumbers sigma{};  ///< 1σ of lens_numbers(model)
  Eigen::Matrix<double, kLensNumbers, kLensNumbers> covariance;
  int views = 0;
  int corners = 0;
  int outliers = 0;      ///< corners rejected by the adjustment
  double median_px = 0;  ///< of the reprojection errors
  double percent95_px = 0;
  double widest_sigma_px = 0;  ///< largest 1σ of a projected position in the picture
  Coverage coverage;
  std::string refusal;  ///< why the result is rejected, on one line; empty where accepted
};

/// `camera` gives kind and size, and a fish-eye's field of view where it is known; otherwise the field ends at the
/// outermost corner. The views of `pictures` are refined with the lens.
CameraCalibration calibrate_camera(const capture::CameraModel& camera, const BoardFinder& finder,
                                   std::vector<BoardPicture>& pictures);

}  // namespace lumigraft::reconstruct
