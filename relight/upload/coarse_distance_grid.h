#pragma once
// Distance to the nearest surface on a coarse grid, beyond the narrow band in which the fused field stores distances.
#include <Eigen/Core>
#include <vector>

namespace lumigraft::relight {

struct LatticePoint {
  Eigen::Vector3i cell;  ///< the cell that contains the point
  Eigen::Vector3f position_m;
};

/// Distance from the centre of every cell to the nearest of the points, at most `max_m`; index x + nx (y + ny z).
/// low_m: lowest corner of the grid. The nearest point of a cell is taken from the nearest non-empty cell (Felzenszwalb
/// & Huttenlocher 2012, exact Euclidean transform), so distances are too long by √3 cells at most, in practice by far
/// less.
std::vector<float> lattice_distances(const std::vector<LatticePoint>& points, const Eigen::Vector3i& size,
                                     const Eigen::Vector3f& low_m, float cell_m, float max_m);

}  // namespace lumigraft::relight
