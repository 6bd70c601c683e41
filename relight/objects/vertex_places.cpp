#include "relight/objects/vertex_places.h"

#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <unordered_map>

namespace lumigraft::relight {
namespace {

using Eigen::Vector3d;

constexpr double kResolved = 1 << 20, kCell = 16;  // of the longest edge; tolerances along a cell's edge

/// Points that are apart by more than a tolerance along some axis.
class ApartPoints {
 public:
  /// The number of the first point near this one, which is added if there is none. `p`: in tolerances, not negative.
  std::uint32_t number_of(const Vector3d& p) {
    const Eigen::Vector3i low = cell_of(p.array() - 1), high = cell_of(p.array() + 1);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          const auto [begin, end] = in_cell_.equal_range(key_of({x, y, z}));
          for (auto i = begin; i != end; ++i) {
            if ((points_[i->second] - p).cwiseAbs().maxCoeff() <= 1) return i->second;
          }
        }
      }
    }
    const auto number = static_cast<std::uint32_t>(points_.size());
    in_cell_.emplace(key_of(cell_of(p)), number);
    points_.push_back(p);
    return number;
  }
  std::size_t count() const { return points_.size(); }

 private:
  static Eigen::Vector3i cell_of(const Eigen::Array3d& p) { return (p / kCell).floor().cast<int>(); }
  static std::int64_t key_of(const Eigen::Vector3i& cell) {
    std::int64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) key = key << 20 | (cell[axis] & 0xfffff);
    return key;
  }

  std::vector<Vector3d> points_;
  std::unordered_multimap<std::int64_t, std::uint32_t> in_cell_;
};

}  // namespace

VertexPlaces vertex_places(const std::vector<Eigen::Vector3f>& positions_m) {
  const std::size_t vertices = positions_m.size();
  VertexPlaces places;
  places.of_vertex.resize(vertices);
  const std::size_t distinct = meshopt_generateVertexRemap(places.of_vertex.data(), nullptr, vertices,
                                                           positions_m.data(), vertices, sizeof(Eigen::Vector3f));
  std::vector<Vector3d> points(distinct);
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < vertices; ++v) box.extend(points[places.of_vertex[v]] = positions_m[v].cast<double>());
  const double longest_m = vertices == 0 ? 0 : box.sizes().maxCoeff(),
               scale = longest_m > 0 ? kResolved / longest_m : 0;
  ApartPoints apart;
  std::vector<std::uint32_t> number(distinct);
  for (std::size_t i = 0; i < distinct; ++i) number[i] = apart.number_of(scale * (points[i] - box.min()));
  for (std::uint32_t& place : places.of_vertex) place = number[place];
  places.count = apart.count();
  return places;
}

}  // namespace lumigraft::relight
