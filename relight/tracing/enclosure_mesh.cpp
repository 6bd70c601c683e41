#include "relight/tracing/enclosure_mesh.h"

#include <algorithm>
#include <cmath>

#include "relight/tracing/meshes.h"
#include "relight/tracing/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;
using Polygon = std::vector<Vector3f>;

/// The part in front of a plane (Sutherland & Hodgman 1974).
Polygon cut(const Polygon& polygon, const reconstruct::Enclosure::Side& side) {
  Polygon left;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3f &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const float at_a = side.normal.dot(a) + side.offset_m, at_b = side.normal.dot(b) + side.offset_m;
    if (at_a >= 0) left.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) left.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return left;
}

Polygon cut_by_others(Polygon polygon, const reconstruct::Enclosure& room, std::size_t own) {
  for (std::size_t i = 0; i < room.sides.size() && !polygon.empty(); ++i) {
    if (i != own) polygon = cut(polygon, room.sides[i]);
  }
  return polygon;
}

Vector3f mean_of(const Polygon& polygon) {
  Vector3f sum = Vector3f::Zero();
  for (const Vector3f& p : polygon) sum += p;
  return sum / static_cast<float>(polygon.size());
}

/// Irradiance of the sides in the room without objects.
class Lighting {
 public:
  Lighting(const reconstruct::Scene& scene, const reconstruct::Enclosure& room, const std::vector<ReferenceMesh>& known)
      : scene_(scene), room_(room), known_(known, nullptr) {}

  Vector3f seen_towards(const Vector3f& p) const { return fisheye_radiance(*scene_.illumination, p); }

  Vector3f irradiance(const Vector3f& p, const Vector3f& n) const {
    Vector3f e = Vector3f::Zero();
    const Vector3f from = p + kTracing.cell_offset_m * n;
    for (const reconstruct::PointLight& lamp : scene_.illumination->lights) {
      const Vector3f to = lamp.distance_known ? (lamp.position_m - from).eval() : lamp.direction;
      const float far = to.norm(), cosine = n.dot(to) / far;
      const float nearly = lamp.distance_known ? std::max(far - lamp.radius_m, 0.0f) : 1e3f;
      if (cosine <= 0 || known_.blocked(from, to / far, nearly)) continue;
      e += cosine *
           (lamp.distance_known ? (lamp.intensity * (lamp.emission(-to / far) / (far * far))).eval() : lamp.irradiance);
    }
    const Vector3f x = n.unitOrthogonal(), y = n.cross(x);
    for (int i = 0; i < kTracing.cell_rays; ++i) {  // cosine distributed
      const float s2 = (static_cast<float>(i) + 0.5f) / kTracing.cell_rays, phi = 2.39996323f * static_cast<float>(i);
      const Vector3f w = std::sqrt(s2) * (std::cos(phi) * x + std::sin(phi) * y) + std::sqrt(1 - s2) * n;
      e += kPi / kTracing.cell_rays * arriving(from, w);
    }
    return e;
  }

 private:
  Vector3f arriving(const Vector3f& from, const Vector3f& w) const {
    if (const auto hit = known_.hit(from, w, 1e3f)) {
      const Vector3f at = from + hit->t_m * w;
      return scene_.field->radiance(at).value_or(seen_towards(at));
    }
    const auto exit = room_.leave(from, w);
    return exit ? seen_towards(from + exit->distance_m * w) : Vector3f::Zero().eval();
  }

  const reconstruct::Scene& scene_;
  const reconstruct::Enclosure& room_;
  Meshes known_;
};

void add_cell(const Polygon& cell, const Vector3f& normal, const Vector3f& albedo, Model& model) {
  const auto first = static_cast<std::uint32_t>(model.positions_m.size());
  for (const Vector3f& p : cell) {
    model.positions_m.push_back(p);
    model.normals.push_back(normal);
    model.texcoords.push_back(Eigen::Vector2f::Zero());
    model.colors.push_back(albedo);
  }
  for (std::uint32_t i = 2; i < cell.size(); ++i) {
    for (const std::uint32_t corner : {0U, i - 1, i}) model.indices.push_back(first + corner);
  }
}

}  // namespace

void add_part_of_vertex_colors(Model& model) {
  Model::Part& part = model.parts.emplace_back();
  part.material.base_color.setOnes();
  part.material.specular = 0;
  part.index_count = static_cast<std::uint32_t>(model.indices.size());
}

Vector3f fisheye_radiance(const reconstruct::Illumination& light, const Vector3f& p_m) {
  const Vector3f w = (p_m - light.probe_position_m).normalized();
  return light.environment.radiance.empty() ? reconstruct::sh_radiance(light.environment_sh, w).cwiseMax(0.0f).eval()
                                            : light.environment.sample(w);
}

std::optional<ReferenceMesh> enclosure_mesh(const reconstruct::Scene& scene, const std::vector<ReferenceMesh>& known) {
  if (!scene.enclosure || !scene.illumination) return std::nullopt;
  reconstruct::Enclosure room = *scene.enclosure;
  for (reconstruct::Enclosure::Side& side : room.sides) side.offset_m += kTracing.behind_voxels * scene.field->voxel_m;

  const Lighting lighting(scene, room, known);
  auto model = std::make_shared<Model>();
  for (std::size_t i = 0; i < room.sides.size(); ++i) {
    const Vector3f n = room.sides[i].normal, x = n.unitOrthogonal(), y = n.cross(x);
    const Vector3f middle = room.middle_m - (n.dot(room.middle_m) + room.sides[i].offset_m) * n;
    // A side starts this large before it is cut by the others; one that stays unbounded is skipped.
    constexpr float max_m = 1e3f;
    const auto at = [&](float u, float v) -> Vector3f { return middle + u * x + v * y; };
    const Polygon side =
        cut_by_others({at(-max_m, -max_m), at(max_m, -max_m), at(max_m, max_m), at(-max_m, max_m)}, room, i);
    Eigen::AlignedBox2f extent;
    for (const Vector3f& p : side) extent.extend(Eigen::Vector2f(x.dot(p - middle), y.dot(p - middle)));
    if (extent.isEmpty() || extent.sizes().maxCoeff() > max_m) continue;
    const Eigen::Vector2f step = extent.sizes() / kTracing.cells;
    for (int j = 0; j < kTracing.cells * kTracing.cells; ++j) {
      const Eigen::Vector2f low =
          extent.min() + step.cwiseProduct(Eigen::Vector2i(j % kTracing.cells, j / kTracing.cells).cast<float>());
      const Eigen::Vector2f high = low + step;
      const Polygon cell = cut_by_others(
          {at(low.x(), low.y()), at(high.x(), low.y()), at(high.x(), high.y()), at(low.x(), high.y())}, room, i);
      if (cell.size() < 3) continue;
      const Vector3f p = mean_of(cell);
      const Vector3f albedo = kPi * lighting.seen_towards(p).cwiseQuotient(lighting.irradiance(p, n).cwiseMax(1e-6f));
      if (albedo.maxCoeff() < kTracing.max_albedo) add_cell(cell, n, albedo, *model);
    }
  }
  add_part_of_vertex_colors(*model);
  return ReferenceMesh{std::move(model), Eigen::Affine3f::Identity(), {}, false, false};
}

}  // namespace lumigraft::relight
