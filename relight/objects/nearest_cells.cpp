#include "relight/objects/nearest_cells.h"

#include <array>
#include <limits>

namespace lumigraft::relight {
namespace {

/// Lower envelopes of parabolas along lines.
class Envelope {
 public:
  explicit Envelope(int longest) : at_(longest), from_(longest), line_(longest) {}

  /// In place: the nearest of the points of a line of `n` cells. Ties are resolved to the lower index.
  void spread(NearestCell* first, std::size_t stride, int n) {
    int count = 0;
    for (int q = 0; q < n; ++q) {
      line_[q] = first[q * stride];
      if (line_[q].point == NearestCell::kNone) continue;
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
  std::vector<NearestCell> line_;
};

}  // namespace

void spread_nearest(std::vector<NearestCell>& cells, const Eigen::Vector3i& size) {
  const std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(size.x()),
                                          static_cast<std::size_t>(size.x()) * size.y()};
  Envelope envelope(size.maxCoeff());
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int b = 0; b < size[v]; ++b) {
      for (int a = 0; a < size[u]; ++a)
        envelope.spread(&cells[a * stride[u] + b * stride[v]], stride[axis], size[axis]);
    }
  }
}

}  // namespace lumigraft::relight
