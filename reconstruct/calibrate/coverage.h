#pragma once
// Which parts of its picture a camera has seen corners in. Lens parameters are not valid in the others.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"

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

}  // namespace lumigraft::reconstruct
