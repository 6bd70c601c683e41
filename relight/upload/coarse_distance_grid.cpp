#include "relight/upload/coarse_distance_grid.h"

#include <algorithm>

#include "relight/objects/nearest_cells.h"

namespace lumigraft::relight {

std::vector<float> lattice_distances(const std::vector<LatticePoint>& points, const Eigen::Vector3i& size,
                                     const Eigen::Vector3f& low_m, float cell_m, float max_m) {
  const std::size_t row = size.x(), layer = row * size.y();
  std::vector<NearestCell> nearest(layer * size.z());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i& c = points[i].cell;
    nearest[c.x() + c.y() * row + c.z() * layer] = {0, static_cast<int>(i)};
  }
  spread_nearest(nearest, size);

  std::vector<float> distance(nearest.size(), max_m);
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const std::size_t i = x + y * row + z * layer;
        if (nearest[i].point == NearestCell::kNone) continue;
        const Eigen::Vector3f middle = low_m + cell_m * (Eigen::Vector3f(x, y, z).array() + 0.5f).matrix();
        distance[i] = std::min(max_m, (points[nearest[i].point].position_m - middle).norm());
      }
    }
  }
  return distance;
}

}  // namespace lumigraft::relight
