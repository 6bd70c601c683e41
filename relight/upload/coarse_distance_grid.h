#pragma once
// How far surfaces are, on a coarse lattice: what a fused field, known near its surfaces alone, doesn't say.
#include <Eigen/Core>
#include <vector>

namespace lumigraft::relight {

struct LatticePoint {
  Eigen::Vector3i cell;  ///< holds the point
  Eigen::Vector3f position_m;
};

/// Distance from the middle of every cell to the nearest of the points, at most `most_m`; index x + nx (y + ny z).
/// The lowest cell's corner lies at low_m. The nearest point is taken as that of the nearest cell (Felzenszwalb &
/// Huttenlocher 2012, exact Euclidean transform), so distances are at most √3 cells too long, in practice far less.
std::vector<float> lattice_distances(const std::vector<LatticePoint>& points, const Eigen::Vector3i& size,
                                     const Eigen::Vector3f& low_m, float cell_m, float most_m);

}  // namespace lumigraft::relight
