#pragma once
// Calibration of one camera from pictures of a board.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"
#include "reconstruct/calibrate/bundle_adjustment.h"
#include "reconstruct/calibrate/coverage.h"

namespace lumigraft::reconstruct {

/// A picture that was kept, and what it shows of the board.
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
  int outliers = 0;      ///< corners that no lens explains
  double median_px = 0;  ///< of the distances between projected and seen corners
  double percent95_px = 0;
  double widest_sigma_px = 0;  ///< 1σ of a pixel where the lens is least known
  Coverage coverage;
  std::string refusal;  ///< why the result is not to be used, on one line; empty where it is
};

/// `camera` has kind and size; a fish-eye's field of view too, where it is known: else it ends where the last corner
/// was seen. The views of `pictures` are measured again as the lens becomes known.
CameraCalibration calibrate_camera(const capture::CameraModel& camera, const BoardFinder& finder,
                                   std::vector<BoardPicture>& pictures);

}  // namespace lumigraft::reconstruct
