#pragma once
// Calibration of one camera from pictures of a board, and of how two cameras stand to each other.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera_model.h"
#include "reconstruct/calibrate_adjust.h"
#include "reconstruct/calibrate_coverage.h"
#include "reconstruct/calibrate_views.h"

namespace lumigraft {

/// A picture that was kept, and what it shows of the board.
struct BoardPicture {
  Image<std::uint16_t> light;
  BoardView view;
};

struct CameraCalibration {
  CameraModel model;
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
CameraCalibration calibrate_camera(const CameraModel& camera, const BoardFinder& finder,
                                   std::vector<BoardPicture>& pictures);

/// How a second camera stands to the first.
struct StandCalibration {
  Eigen::Isometry3d T_second_first = Eigen::Isometry3d::Identity();
  Eigen::Vector3d turn_sigma_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift_sigma_m = Eigen::Vector3d::Zero();
  int moments = 0;  ///< at which both saw the board
  double median_px = 0;
  std::string refusal;
};

/// `first` and `second` hold what each camera saw at the same moments, and become what both together say.
StandCalibration calibrate_stand(CameraCalibration& first, CameraCalibration& second,
                                 const std::vector<BoardView>& first_views, const std::vector<BoardView>& second_views);

}  // namespace lumigraft
