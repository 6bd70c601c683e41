#pragma once
// Which parts of its picture a camera has seen corners in. Lens numbers say nothing about the others.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"

namespace lumigraft::reconstruct {

/// A pinhole's picture in 8 × 6 cells from the top left; a fish-eye's field in rings of 10° from the axis (rows) and
/// twelve sectors (columns) that begin at the right and go on clockwise, as the picture shows it.
struct Coverage {
  bool rings = false;
  int columns = 0, rows = 0;
  std::vector<int> corners;  ///< by cell
  double field_rad = 0;      ///< fish-eye: half its field
  double widest_rad = 0;     ///< largest angle from the axis that a corner was seen at
  std::vector<char> wanted;  ///< by cell: the picture shows it, and calibration rests on it

  int at(int column, int row) const { return corners[static_cast<std::size_t>(row) * columns + column]; }
  bool wants(int column, int row) const { return wanted[static_cast<std::size_t>(row) * columns + column] != 0; }
  /// Share of the wanted cells that a corner reached.
  double reached() const;
  /// The side that lacks most of its outer cells: "right", "upper left". Empty where none lacks any.
  std::string missing() const;
  /// A map of characters: a line for each row, '#' many corners, '+' some, '.' none, ' ' not wanted.
  std::string map() const;
};

/// `camera.fov_rad` is a fish-eye's field where it is known; else the field ends with the picture's nearest side, or
/// with the outermost corner.
Coverage coverage_of(const capture::CameraModel& camera, const std::vector<Eigen::Vector2d>& pixels);

}  // namespace lumigraft::reconstruct
