#include "relight/objects/solid_voxels.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "relight/objects/parameters.h"
#include "relight/objects/vertex_places.h"

namespace lumigraft::relight {
namespace {

class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t ra = root(a), rb = root(b);
    parent_[std::max(ra, rb)] = std::min(ra, rb);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// An edge between positions low < high. count: traversals low to high minus traversals high to low.
struct Edge {
  std::uint32_t low, high;
  int count;
};

std::vector<Edge> boundary_edges(const std::vector<std::uint32_t>& place, const std::vector<std::uint32_t>& indices) {
  std::vector<Edge> edges;
  edges.reserve(indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const std::uint32_t a = place[indices[i]], b = place[indices[i % 3 == 2 ? i - 2 : i + 1]];
    if (a != b) edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
  std::vector<Edge> boundary;
  for (std::size_t i = 0; i < edges.size();) {
    Edge sum = edges[i];
    for (++i; i < edges.size() && edges[i].low == sum.low && edges[i].high == sum.high; ++i)
      sum.count += edges[i].count;
    if (sum.count != 0) boundary.push_back(sum);
  }
  return boundary;
}

double area_m2(const std::array<Eigen::Vector3f, 3>& t) {
  return 0.5 * (t[1] - t[0]).cast<double>().cross((t[2] - t[0]).cast<double>()).norm();
}

// Twice the signed area of (a, b, p) in the xy plane, with p shifted by (ε, ε²), ε → 0+: the sign is never zero, unless
// a and b coincide. The end points are ordered first, so that both triangles at an edge get the same value.
struct Side {
  double value;  // without the shift
  int sign;      // with it
};

Side side_of(const Eigen::Vector3f& from, const Eigen::Vector3f& to, double x, double y) {
  const bool swap = from.x() > to.x() || (from.x() == to.x() && from.y() > to.y());
  const Eigen::Vector3f& a = swap ? to : from;
  const Eigen::Vector3f& b = swap ? from : to;
  const double dx = double{b.x()} - a.x(), dy = double{b.y()} - a.y();
  const double value = dx * (y - a.y()) - dy * (x - a.x());
  double decided = value;
  if (decided == 0) decided = -dy;
  if (decided == 0) decided = dx;
  const int sign = (decided > 0) - (decided < 0);
  return swap ? Side{-value, -sign} : Side{value, sign};
}

// Intersection of the vertical line through a voxel column with a triangle.
struct Crossing {
  std::uint32_t column;
  float z;
  int sign;  // +1: the triangle's normal points up
};

}  // namespace

ObjectSolid::ObjectSolid(const Model& model) {
  const std::size_t vertices = model.positions_m.size(), triangles = model.indices.size() / 3;
  const VertexPlaces at = vertex_places(model.positions_m);
  const std::vector<std::uint32_t>& place = at.of_vertex;
  const std::size_t places = at.count;
  std::vector<Eigen::Vector3f> position(places);
  for (std::size_t v = 0; v < vertices; ++v) position[place[v]] = model.positions_m[v];

  UnionFind connected(places);
  for (std::size_t i = 0; i < 3 * triangles; i += 3) {
    connected.join(place[model.indices[i]], place[model.indices[i + 1]]);
    connected.join(place[model.indices[i]], place[model.indices[i + 2]]);
  }
  std::vector<std::uint32_t> component_of_place(places);
  for (std::uint32_t v = 0; v < places; ++v) {
    if (connected.root(v) == v) {
      component_of_place[v] = static_cast<std::uint32_t>(components_.size());
      components_.emplace_back();
    } else {
      component_of_place[v] = component_of_place[connected.root(v)];  // a root precedes its members
    }
  }

  component_of_triangle_.resize(triangles);
  std::vector<std::pair<std::uint32_t, Triangle>> faces(triangles);  // with their component; after them the cones
  for (std::size_t t = 0; t < triangles; ++t) {
    for (int k = 0; k < 3; ++k) faces[t].second[k] = model.positions_m[model.indices[3 * t + k]];
    component_of_triangle_[t] = faces[t].first = component_of_place[place[model.indices[3 * t]]];
  }

  // Triangle fans over the boundary: one per connected piece, with the mean of its edges as apex.
  const std::vector<Edge> boundary = boundary_edges(place, model.indices);
  UnionFind pieces(places);
  for (const Edge& edge : boundary) pieces.join(edge.low, edge.high);
  std::vector<Eigen::Vector4d> apex(places, Eigen::Vector4d::Zero());
  for (const Edge& edge : boundary) {
    apex[pieces.root(edge.low)] +=
        (position[edge.low] + position[edge.high]).cast<double>().homogeneous() + Eigen::Vector4d(0, 0, 0, 1);
  }
  for (const Edge& edge : boundary) {
    const Eigen::Vector3f top = apex[pieces.root(edge.low)].hnormalized().cast<float>();
    const bool forward = edge.count > 0;  // the mesh traverses it low to high, so the fan high to low
    const Triangle cone = {position[forward ? edge.high : edge.low], position[forward ? edge.low : edge.high], top};
    for (int n = 0; n < std::abs(edge.count); ++n) faces.emplace_back(component_of_place[edge.low], cone);
  }

  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto& [index, t] = faces[i];
    Component& component = components_[index];
    (i < triangles ? component.area_m2 : component.cone_area_m2) += area_m2(t);
    component.volume_m3 += t[0].cast<double>().dot(t[1].cast<double>().cross(t[2].cast<double>())) / 6;
  }
  for (Component& component : components_) {
    component.solid = component.cone_area_m2 <= kObjects.max_cone_fraction * component.area_m2;
    component.orientation = component.volume_m3 < 0 ? -1.0f : 1.0f;
  }
  for (const auto& [index, face] : faces) {
    if (components_[index].solid) closed_.push_back(face);
  }
}

std::vector<std::uint8_t> ObjectSolid::inside(const std::array<int, 3>& size, const Eigen::Vector3f& origin_m,
                                              float voxel_m) const {
  // Winding number along each column of voxels: starting at 0 from far below, crossing a face against its normal adds
  // one, along its normal subtracts one.
  std::vector<Crossing> crossings;
  const auto column_range = [&](const Triangle& t, int axis) {
    const float low = std::min({t[0][axis], t[1][axis], t[2][axis]}) - origin_m[axis];
    const float high = std::max({t[0][axis], t[1][axis], t[2][axis]}) - origin_m[axis];
    return std::pair(std::max(0, static_cast<int>(std::floor(low / voxel_m))),
                     std::min(size[axis] - 1, static_cast<int>(std::ceil(high / voxel_m))));
  };
  for (const Triangle& t : closed_) {
    const auto [i0, i1] = column_range(t, 0);
    const auto [j0, j1] = column_range(t, 1);
    for (int j = j0; j <= j1; ++j) {
      for (int i = i0; i <= i1; ++i) {
        const double x = origin_m.x() + double{voxel_m} * i, y = origin_m.y() + double{voxel_m} * j;
        const Side s0 = side_of(t[1], t[2], x, y), s1 = side_of(t[2], t[0], x, y), s2 = side_of(t[0], t[1], x, y);
        if (s0.sign == 0 || s0.sign != s1.sign || s0.sign != s2.sign) continue;
        const double sum = s0.value + s1.value + s2.value;
        const double z = sum != 0 ? (s0.value * t[0].z() + s1.value * t[1].z() + s2.value * t[2].z()) / sum : t[0].z();
        crossings.push_back({static_cast<std::uint32_t>(i + size[0] * j), static_cast<float>(z), s0.sign});
      }
    }
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return a.column != b.column ? a.column < b.column : a.z < b.z;
  });

  std::vector<std::uint8_t> result(static_cast<std::size_t>(size[0]) * size[1] * size[2], 0);
  const std::size_t columns = static_cast<std::size_t>(size[0]) * size[1];
  for (std::size_t c = 0; c < crossings.size();) {
    const std::uint32_t column = crossings[c].column;
    int winding = 0;
    for (int k = 0; k < size[2]; ++k) {
      const float z = origin_m.z() + voxel_m * static_cast<float>(k);
      for (; c < crossings.size() && crossings[c].column == column && crossings[c].z < z; ++c)
        winding -= crossings[c].sign;
      if (winding != 0) result[column + columns * k] = 1;
    }
    while (c < crossings.size() && crossings[c].column == column) ++c;
  }
  return result;
}

}  // namespace lumigraft::relight
