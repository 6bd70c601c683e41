#include "tests/bench/comparators/room_model.h"

#include <optional>

#include "relight/objects/mesh_refine.h"

namespace lumigraft::comparators {
namespace {

using Eigen::Vector3f;

constexpr float kApart_m = 1e-5f;  // offset between triangles of different planes
constexpr float kNear_m = 2e-4f;   // tolerance for a vertex on its own surface

struct Corner {
  Vector3f position_m, normal, color;
};
using Polygon = std::vector<Corner>;

Corner between(const Corner& a, const Corner& b, float t) {
  return {a.position_m + t * (b.position_m - a.position_m), a.normal + t * (b.normal - a.normal),
          a.color + t * (b.color - a.color)};
}

/// Clips a polygon to sign · x[axis] <= sign · bound (Sutherland & Hodgman 1974).
Polygon cut(const Polygon& polygon, int axis, float sign, float bound) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const float da = sign * (a.position_m[axis] - bound), db = sign * (b.position_m[axis] - bound);
    if (da <= 0) kept.push_back(a);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) kept.push_back(between(a, b, da / (da - db)));
  }
  return kept;
}

Polygon clipped(Polygon polygon, const Eigen::AlignedBox3f& box) {
  for (int axis = 0; axis < 3; ++axis) {
    polygon = cut(cut(polygon, axis, 1, box.max()[axis]), axis, -1, box.min()[axis]);
  }
  return polygon;
}

void add(relight::Model& model, const Corner& corner) {
  model.indices.push_back(static_cast<std::uint32_t>(model.positions_m.size()));
  model.positions_m.push_back(corner.position_m);
  model.normals.push_back(corner.normal.normalized());
  model.texcoords.push_back(Eigen::Vector2f::Zero());
  model.colors.push_back(corner.color);
}

/// Diffuse albedo, from a short ray that hits the surface there.
std::optional<Vector3f> shown_albedo(const relight::TraceWorld& world, const Vector3f& p_m, const Vector3f& normal) {
  const auto hit = world.real.hit(p_m + kNear_m * normal, -normal, 2 * kNear_m);
  if (!hit) return std::nullopt;
  return world.real.surface(*hit, -normal).bsdf.diffuse.matrix();
}

}  // namespace

std::shared_ptr<const relight::Model> room_model(const relight::TraceWorld& world, const Eigen::AlignedBox3f& box,
                                                 float longest_m) {
  relight::Model model;
  for (const relight::ReferenceMesh& mesh : world.scene->real) {
    const relight::Model& mesh_model = *mesh.model;
    relight::Model::Part part;
    part.material = mesh.material.over({Vector3f::Ones(), 0, 1, 0});
    part.first_index = static_cast<std::uint32_t>(model.indices.size());
    for (std::size_t i = 0; i + 2 < mesh_model.indices.size(); i += 3) {
      Polygon polygon;
      for (std::size_t k = i; k < i + 3; ++k) {
        const std::uint32_t v = mesh_model.indices[k];
        polygon.push_back({mesh.T_tag_model * mesh_model.positions_m[v],
                           mesh.T_tag_model.linear() * mesh_model.normals[v],
                           mesh.material.base_color ? Vector3f::Ones() : mesh_model.colors[v]});
      }
      const Vector3f face =
          (polygon[1].position_m - polygon[0].position_m).cross(polygon[2].position_m - polygon[0].position_m);
      polygon = clipped(std::move(polygon), box);
      for (Corner& corner : polygon) corner.position_m += kApart_m * face.stableNormalized();
      for (std::size_t k = 2; k < polygon.size(); ++k) {
        for (const std::size_t corner : {std::size_t{0}, k - 1, k}) add(model, polygon[corner]);
      }
    }
    part.index_count = static_cast<std::uint32_t>(model.indices.size()) - part.first_index;
    if (part.index_count > 0) model.parts.push_back(part);
  }
  auto refined = std::make_shared<relight::Model>(*relight::refine_model(model, longest_m));
  for (const relight::Model::Part& part : refined->parts) {
    if (part.material.metallic > 0 || part.material.specular > 0) continue;  // a known surface: its colour is uniform
    for (std::size_t i = part.first_index; i < part.first_index + part.index_count; ++i) {
      const std::uint32_t v = refined->indices[i];
      if (const auto albedo = shown_albedo(world, refined->positions_m[v], refined->normals[v])) {
        refined->colors[v] = *albedo;
      }
    }
  }
  return refined;
}

}  // namespace lumigraft::comparators
