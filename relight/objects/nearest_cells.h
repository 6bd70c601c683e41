#pragma once
// Nearest point of every cell of a grid: exact Euclidean distance transform (Felzenszwalb & Huttenlocher 2012).
#include <Eigen/Core>
#include <vector>

namespace lumigraft::relight {

struct NearestCell {
  static constexpr int kNone = -1;

  int squared = 0;  ///< cells, from this cell to the one that contains the point
  int point = kNone;
};

/// Index of the cells: x + nx (y + ny z). In: cells with a point have its number, 0 apart; the others kNone. Out: all
/// have the number of the nearest point, or kNone if there is no point at all.
void spread_nearest(std::vector<NearestCell>& cells, const Eigen::Vector3i& size);

}  // namespace lumigraft::relight
