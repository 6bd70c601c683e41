#pragma once
// Vignetting of a lens, from the white paper of a board that was shown all over its picture.
//
// The illumination of the paper is unknown, but smooth at every moment: over the board, ln(light) is a free constant
// plus a slope and a curvature, which are small and differ between moments, while the lens is the same in all of them.
// This is a linear mixed model (Laird & Ware 1982): the variances of slopes, curvatures and readings are estimated from
// the pictures (restricted maximum likelihood by expectation maximisation), and the lens's uncertainty follows. Boards
// held near each other are lit alike by the same lamps, so slopes are not independent between moments: their
// contribution to the variance counts fourfold.
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/vignetting.h"
#include "reconstruct/calibrate/board_detection.h"

namespace lumigraft::reconstruct {

/// A patch of white paper in a picture.
struct WhiteSample {
  std::size_t moment = 0;
  Eigen::Vector2d on_board_m = Eigen::Vector2d::Zero();
  double angle_rad = 0;  ///< from the optical axis
  double light = 0;      ///< linear, in any unit, the same within a moment
};

/// White samples of every tag in the views of a camera, by moment.
std::vector<WhiteSample> white_of(const std::vector<BoardView>& views, const capture::CameraModel& camera);

struct VignettingCalibration {
  capture::Vignetting vignetting;
  int moments = 0, samples = 0;
  double field_rad = 0;     ///< half of the lens's field of view
  double widest_rad = 0;    ///< largest angle with white samples
  double edge = 1;          ///< transmission at the edge of the field
  double widest_sigma = 0;  ///< largest relative 1σ of transmission in the field
  double unevenness = 0;    ///< relative 1σ of the illumination between two ends of the board
  double residual = 0;      ///< relative 1σ of a reading
  std::string refusal;      ///< why it is rejected, on one line; empty where accepted
};

/// `field_rad` is half of the lens's field of view.
VignettingCalibration calibrate_vignetting(const std::vector<WhiteSample>& samples, double field_rad);

}  // namespace lumigraft::reconstruct
