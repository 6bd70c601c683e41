#pragma once
// How much light a lens loses away from its axis, from the white of a board that was shown all over its picture.
//
// How brightly the paper was lit is not known. What is: at every moment it was lit smoothly, so that over the board
// ln(light) is a constant, which is free, and a slope and a bend, which are small and differ from moment to moment,
// while the lens is the same in all of them. That is a linear mixed model (Laird & Ware 1982): how large slopes and
// bends are, and how noisy the readings, is told by the pictures themselves (their restricted likelihood, by
// expectation and maximisation), and the lens's uncertainty follows. Boards that are held near each other are lit by
// the same lamps alike, so that slopes are fewer than moments: what they cost in certainty counts fourfold.
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/vignetting.h"
#include "reconstruct/calibrate/board_detection.h"

namespace lumigraft::reconstruct {

/// A piece of white paper in a picture.
struct WhiteSample {
  std::size_t moment = 0;
  Eigen::Vector2d on_board_m = Eigen::Vector2d::Zero();
  double angle_rad = 0;  ///< from the lens's axis
  double light = 0;      ///< linear, in any unit that is the same for one moment
};

/// The paper of every tag that a camera of this lens saw, by moment.
std::vector<WhiteSample> white_of(const std::vector<BoardView>& views, const capture::CameraModel& camera);

struct VignettingCalibration {
  capture::Vignetting vignetting;
  int moments = 0, samples = 0;
  double field_rad = 0;     ///< half of the lens's field
  double widest_rad = 0;    ///< to which white was seen
  double edge = 1;          ///< transmission at the edge of the field
  double widest_sigma = 0;  ///< 1σ of transmission where it is least known in the field, as a share of itself
  double unevenness = 0;    ///< 1σ of how differently two ends of the board were lit, as a share
  double residual = 0;      ///< 1σ of what a reading is off, as a share
  std::string refusal;      ///< why it is not to be used, on one line; empty where it is
};

/// `field_rad` is half the lens's field.
VignettingCalibration calibrate_vignetting(const std::vector<WhiteSample>& samples, double field_rad);

}  // namespace lumigraft::reconstruct
