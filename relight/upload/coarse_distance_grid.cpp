#include "relight/upload/coarse_distance_grid.h"

#include <algorithm>
#include <limits>

namespace lumigraft::relight {
namespace {

constexpr int kNone = -1;

struct Nearest {
  int squared = 0;  ///< cells
  int point = kNone;
};

/// Lower envelopes of parabolas along lines.
class Envelope {
 public:
  explicit Envelope(int longest) : at_(longest), from_(longest), line_(longest) {}

  /// In place: the nearest of the points of a line of `n` cells. Ties are resolved to the lower index.
  void spread(Nearest* first, std::size_t stride, int n) {
    int count = 0;
    for (int q = 0; q < n; ++q) {
      line_[q] = first[q * stride];
      if (line_[q].point == kNone) continue;
      float from = -std::numeric_limits<float>::infinity();
      while (count > 0) {
        const int p = at_[count - 1];
        from =
            static_cast<float>(line_[q].squared + q * q - line_[p].squared - p * p) / static_cast<float>(2 * (q - p));
        if (from > from_[count - 1]) break;
        --count;
      }
      if (count == 0) from = -std::numeric_limits<float>::infinity();
      at_[count] = q;
      from_[count++] = from;
    }
    for (int q = 0, k = 0; count > 0 && q < n; ++q) {
      while (k + 1 < count && from_[k + 1] < static_cast<float>(q)) ++k;
      const int apart = q - at_[k];
      first[q * stride] = {line_[at_[k]].squared + apart * apart, line_[at_[k]].point};
    }
  }

 private:
  std::vector<int> at_;
  std::vector<float> from_;
  std::vector<Nearest> line_;
};

}  // namespace

std::vector<float> lattice_distances(const std::vector<LatticePoint>& points, const Eigen::Vector3i& size,
                                     const Eigen::Vector3f& low_m, float cell_m, float max_m) {
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(size.x()),
                                          static_cast<std::size_t>(size.x()) * size.y()};
  std::vector<Nearest> nearest(stride[2] * size.z());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i& c = points[i].cell;
    nearest[c.x() * stride[0] + c.y() * stride[1] + c.z() * stride[2]] = {0, static_cast<int>(i)};
  }
  Envelope envelope(size.maxCoeff());
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int b = 0; b < size[v]; ++b) {
      for (int a = 0; a < size[u]; ++a)
        envelope.spread(&nearest[a * stride[u] + b * stride[v]], stride[axis], size[axis]);
    }
  }

  std::vector<float> distance(nearest.size(), max_m);
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const std::size_t i = x + y * stride[1] + z * stride[2];
        if (nearest[i].point == kNone) continue;
        const Eigen::Vector3f middle = low_m + cell_m * (Eigen::Vector3f(x, y, z).array() + 0.5f).matrix();
        distance[i] = std::min(max_m, (points[nearest[i].point].position_m - middle).norm());
      }
    }
  }
  return distance;
}

}  // namespace lumigraft::relight
