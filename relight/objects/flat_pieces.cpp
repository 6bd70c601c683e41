#include "relight/objects/flat_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "relight/objects/parameters.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

struct Triangle {
  Vector3f a, b, c, normal;
  float area_m2 = 0;
  bool flat = false;
};

std::vector<Triangle> triangles_of(const Model& model) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i + 2 < model.indices.size(); i += 3) {
    Triangle t;
    const std::uint32_t* v = &model.indices[i];
    t.a = model.positions_m[v[0]];
    t.b = model.positions_m[v[1]];
    t.c = model.positions_m[v[2]];
    const Vector3f cross = (t.b - t.a).cross(t.c - t.a);
    t.area_m2 = 0.5f * cross.norm();
    if (!(t.area_m2 > 0)) continue;
    t.normal = cross.normalized();
    const Vector3f mean = model.normals[v[0]] + model.normals[v[1]] + model.normals[v[2]];
    if (t.normal.dot(mean) < 0) t.normal = -t.normal;
    t.flat = std::all_of(v, v + 3, [&](std::uint32_t k) { return model.normals[k].dot(t.normal) > kObjects.flat; });
    triangles.push_back(t);
  }
  return triangles;
}

float cross2(const Vector2f& a, const Vector2f& b) { return a.x() * b.y() - a.y() * b.x(); }

bool inside(const Vector2f& p, const Vector2f& a, const Vector2f& b, const Vector2f& c) {
  const float u = cross2(b - a, p - a), v = cross2(c - b, p - b), w = cross2(a - c, p - c);
  constexpr float e = kObjects.seam;
  return (u >= -e && v >= -e && w >= -e) || (u <= e && v <= e && w <= e);
}

/// The rectangle of minimum area around a shape has an edge along one of the shape's edges (Freeman & Shapira 1975);
/// those of the largest triangles are tested.
void fit_rectangle(const std::vector<Triangle>& members, FlatPiece& piece) {
  float min_area = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < std::min(members.size(), kObjects.tried); ++i) {
    const Triangle& tried = members[i];
    for (const Vector3f& edge :
         {Vector3f(tried.b - tried.a), Vector3f(tried.c - tried.b), Vector3f(tried.a - tried.c)}) {
      const Vector3f u = (edge - piece.normal.dot(edge) * piece.normal).normalized(), v = piece.normal.cross(u);
      Eigen::AlignedBox2f box;
      for (const Triangle& t : members) {
        for (const Vector3f& p : {t.a, t.b, t.c}) box.extend(Vector2f(u.dot(p), v.dot(p)));
      }
      const float area = box.sizes().prod();
      if (!(area < 0.999f * min_area)) continue;
      min_area = area;
      piece.centre_m = box.center().x() * u + box.center().y() * v + piece.offset_m * piece.normal;
      piece.half_along_m = 0.5f * box.sizes().x() * u;
      piece.half_across_m = 0.5f * box.sizes().y() * v;
    }
  }
}

void draw_outline(const std::vector<Triangle>& members, FlatPiece& piece) {
  constexpr int n = shader::kOutline;
  piece.outline.assign(static_cast<std::size_t>(n) * n, 0);
  const Vector3f along = piece.half_along_m / piece.half_along_m.squaredNorm(),
                 across = piece.half_across_m / piece.half_across_m.squaredNorm();
  const auto place = [&](const Vector3f& p) {
    const Vector3f d = p - piece.centre_m;
    return Vector2f((0.5f + 0.5f * along.dot(d)) * n - 0.5f, (0.5f + 0.5f * across.dot(d)) * n - 0.5f);
  };
  for (const Triangle& t : members) {
    const Vector2f a = place(t.a), b = place(t.b), c = place(t.c);
    const auto texel = [](float q) { return std::clamp(static_cast<int>(q), 0, n - 1); };
    const Vector2f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    for (int row = texel(low.y()); row <= texel(high.y() + 1); ++row) {
      for (int column = texel(low.x()); column <= texel(high.x() + 1); ++column) {
        if (inside(Vector2f(static_cast<float>(column), static_cast<float>(row)), a, b, c)) {
          piece.outline[static_cast<std::size_t>(row * n + column)] = 255;
        }
      }
    }
  }
}

}  // namespace

std::vector<FlatPiece> flat_pieces(const Model& model) {
  std::vector<Triangle> triangles = triangles_of(model);
  Vector3f sum = Vector3f::Zero();
  float area = 0;
  for (const Triangle& t : triangles) {
    sum += t.area_m2 * t.normal;
    area += t.area_m2;
  }
  const bool sheet = sum.norm() > kObjects.closed * area;
  std::stable_sort(triangles.begin(), triangles.end(),
                   [](const Triangle& a, const Triangle& b) { return a.area_m2 > b.area_m2; });

  // Each triangle joins the piece of the largest triangle in its plane; clusters that are too small are dropped.
  struct Cluster {
    FlatPiece piece;
    std::vector<Triangle> members;
  };
  std::vector<Cluster> clusters;
  for (const Triangle& t : triangles) {
    if (!t.flat) continue;
    const auto found = std::find_if(clusters.begin(), clusters.end(), [&](const Cluster& cluster) {
      const FlatPiece& p = cluster.piece;
      const auto near = [&](const Vector3f& at) { return std::abs(p.normal.dot(at) - p.offset_m) < kObjects.near_m; };
      return p.normal.dot(t.normal) > kObjects.same_normal && near(t.a) && near(t.b) && near(t.c);
    });
    const bool is_new = found == clusters.end();
    if (is_new && clusters.size() == kObjects.max_pieces) continue;
    Cluster& cluster = is_new ? clusters.emplace_back() : *found;
    if (is_new) {
      cluster.piece.normal = t.normal;
      cluster.piece.offset_m = t.normal.dot(t.a);
      cluster.piece.two_sided = sheet;
    }
    cluster.members.push_back(t);
    cluster.piece.area_m2 += t.area_m2;
  }
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const Cluster& a, const Cluster& b) { return a.piece.area_m2 > b.piece.area_m2; });

  std::vector<FlatPiece> pieces;
  for (Cluster& cluster : clusters) {
    if (pieces.size() == shader::kMaxMirrors) break;
    if (cluster.piece.area_m2 < std::max(kObjects.min_area_m2, kObjects.min_area * area)) break;
    fit_rectangle(cluster.members, cluster.piece);
    draw_outline(cluster.members, cluster.piece);
    pieces.push_back(std::move(cluster.piece));
  }
  return pieces;
}

}  // namespace lumigraft::relight
