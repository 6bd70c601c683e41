#pragma once
// Intrinsic calibration of one camera from pictures of a board, and which parts of its picture it has seen corners in:
// lens parameters are not valid in the others.
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"
#include "reconstruct/calibrate/bundle_adjustment.h"

namespace lumigraft::reconstruct {

/// A pinhole's picture has 8 × 6 cells from the top left; a fish-eye's field has rings of 10° from the axis (rows) and
/// twelve sectors (columns) that start at the right and continue clockwise in the picture.
struct Coverage {
  bool rings = false;
  int columns = 0, rows = 0;
  std::vector<int> corners;  ///< by cell
  double field_rad = 0;      ///< fish-eye: half its field
  double widest_rad = 0;     ///< largest angle of a corner from the axis
  std::vector<char> wanted;  ///< by cell: inside the picture, and required for calibration

  int at(int column, int row) const { return corners[static_cast<std::size_t>(row) * columns + column]; }
  bool wants(int column, int row) const { return wanted[static_cast<std::size_t>(row) * columns + column] != 0; }
  /// Fraction of the required cells that contain a corner.
  double reached() const;
  /// The side with the most empty outer cells: "right", "upper left". Empty where none is empty.
  std::string missing() const;
  /// A text map, one line per row: '#' many corners, '+' some, '.' none, ' ' not required.
  std::string map() const;
};

/// `camera.fov_rad` is a fish-eye's field where it is known; otherwise the field ends at the nearest border of the
/// picture, or at the outermost corner if that is farther.
Coverage coverage_of(const capture::CameraModel& camera, const std::vector<Eigen::Vector2d>& pixels);

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
