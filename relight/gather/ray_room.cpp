#include "relight/gather/ray_room.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "reconstruct/field/radiance_bound.h"
#include "reconstruct/math/tag_family.h"
#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

bool is_flat_enough(const Vector3f& p_m) { return std::abs(p_m.z()) < kGather.paper_m; }

void add_patches(const Model& model, std::vector<Patch>& patches) {
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    const Vector3f &a = model.positions_m[model.indices[t]], &b = model.positions_m[model.indices[t + 1]],
                   &c = model.positions_m[model.indices[t + 2]];
    const Vector3f n = (b - a).cross(c - a).stableNormalized();
    const int steps =
        std::clamp(static_cast<int>(std::max((b - a).norm(), (c - a).norm()) / kGather.patch_m) + 1, 1, 200);
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; i + j < steps; ++j) {
        const float u = (static_cast<float>(i) + 0.33f) / static_cast<float>(steps),
                    v = (static_cast<float>(j) + 0.33f) / static_cast<float>(steps);
        patches.push_back({a + u * (b - a) + v * (c - a), n});
      }
    }
  }
}

/// Whether the field has a lower bound of radiance there, and nothing better.
bool clips_at(const reconstruct::DistanceField& field, const Vector3f& p_m) {
  const Eigen::Vector3i voxel = (p_m / field.voxel_m).array().round().matrix().cast<int>();
  const reconstruct::FieldBrick* brick = field.brick(reconstruct::brick_of(voxel));
  const auto i = static_cast<std::size_t>(reconstruct::index_in_brick(voxel));
  return brick && reconstruct::radiance_is_bound(*brick, i);
}

bool is_in_front(const Vector3f& eye_m, const Vector3f& p_m, const Vector3f& normal) {
  return normal.dot(eye_m - p_m) > 0;
}

/// Whether a camera was in front of the surface: else its radiance is that of a side next to it, or of the other side
/// of something thin.
bool was_seen(const reconstruct::Scene& scene, const Vector3f& p_m, const Vector3f& normal) {
  const auto from = [&](const Vector3f& camera_m) { return is_in_front(camera_m, p_m, normal); };
  return (scene.pose && from(scene.pose->T_tag_camera.translation().cast<float>())) ||
         std::any_of(scene.field->seen_from_m.begin(), scene.field->seen_from_m.end(), from);
}

}  // namespace

RayRoom::RayRoom(const reconstruct::Scene& scene, const std::vector<KnownSurface>& known, const capture::Tag& tag)
    : light_(reference_room_of(scene, known)), illumination_(scene.illumination) {
  auto made = std::make_shared<Surfaces>();
  Surfaces& s = *made;
  s.real = std::exchange(light_.real, {});
  s.paper_m = static_cast<float>(reconstruct::print_edge_m(tag));
  s.field = scene.field;
  s.albedo = scene.albedo;
  s.enclosure = scene.enclosure;
  for (const ReferenceLamp& lamp : light_.lamps) lamp_samples_.emplace_back(lamp, 0);
  s.meshes = std::make_unique<Meshes>(s.real, nullptr);
  s.vertices.resize(s.real.size());
  s.facets.resize(s.real.size());
  for (std::size_t i = 0; i < s.real.size(); ++i) {
    const Model& model = *s.real[i].model;
    const bool is_known = !s.real[i].material.empty();
    if (is_known) {
      add_patches(model, s.patches);
      continue;
    }
    const bool fused = i == 0;
    for (std::size_t v = 0; v < model.positions_m.size(); ++v) {
      s.vertices[i].push_back({model.positions_m[v], model.normals[v], Rgb::Zero(), model.colors[v], false});
      s.patches.push_back({model.positions_m[v], model.normals[v]});
    }
    fused ? color_fused_surface(scene, s.vertices[i]) : color_enclosure(s.vertices[i]);
    for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
      const std::uint32_t* corner = &model.indices[t];
      const auto& p = model.positions_m;
      RoomFacet& facet = s.facets[i].emplace_back();
      facet.fused = facet.colored = fused;
      facet.normal = (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]]).stableNormalized();
      const Vector3f seen = model.normals[corner[0]] + model.normals[corner[1]] + model.normals[corner[2]];
      if (facet.normal.dot(seen) < 0) facet.normal = -facet.normal;
      for (int k = 0; k < 3; ++k) {
        facet.albedo += model.colors[corner[k]].array() / 3;
        facet.before += s.vertices[i][corner[k]].before / 3;
        facet.colored &= s.vertices[i][corner[k]].colored;
      }
    }
  }
  surfaces_ = std::move(made);
  sky_ = std::make_unique<Sky>(light_);
}

void RayRoom::color_fused_surface(const reconstruct::Scene& scene, std::vector<MeasuredVertex>& vertices) const {
  Rgb albedo = Rgb::Zero();  // in the mean
  float known = 0;
  for (const MeasuredVertex& vertex : vertices) {
    if (!(vertex.albedo.maxCoeff() > 0)) continue;
    albedo += vertex.albedo;
    ++known;
  }
  albedo /= std::max(known, 1.0f);
  for (MeasuredVertex& vertex : vertices) {
    const Vector3f& p = vertex.position_m;
    const bool seen = was_seen(scene, p, vertex.normal), has_albedo = vertex.albedo.maxCoeff() > 0;
    const auto measured = seen ? scene.field->radiance(p) : std::nullopt;
    const bool modelled = !measured && has_albedo && (!seen || clips_at(*scene.field, p));
    vertex.colored = has_albedo && (measured || modelled);
    if (measured)
      vertex.before = *measured;
    else if (modelled || !is_in_front(illumination_->probe_position_m, p, vertex.normal))
      vertex.before = modelled_before(has_albedo ? vertex.albedo : albedo, p, vertex.normal);
    else
      vertex.before = fisheye_radiance(*illumination_, p);
  }
}

void RayRoom::color_enclosure(std::vector<MeasuredVertex>& vertices) const {
  for (MeasuredVertex& vertex : vertices) {
    vertex.colored = vertex.albedo.maxCoeff() > 0;
    vertex.before = fisheye_radiance(*illumination_, vertex.position_m);
  }
}

RayRoom::RayRoom(const RayRoom& room, std::shared_ptr<const reconstruct::Illumination> illumination)
    : surfaces_(room.surfaces_), illumination_(std::move(illumination)) {
  light_room(*illumination_, light_);
  for (const ReferenceLamp& lamp : light_.lamps) lamp_samples_.emplace_back(lamp, 0);
  sky_ = std::make_unique<Sky>(light_);
}

bool RayRoom::has_surfaces_of(const reconstruct::Scene& scene) const {
  return surfaces_->field == scene.field && surfaces_->albedo == scene.albedo &&
         surfaces_->enclosure == scene.enclosure;
}

RealPoint RayRoom::point(const MeshHit& hit, const Vector3f& w) const {
  if (facet(hit)) return measured_point(hit, w);
  RealPoint point{surfaces_->meshes->surface(hit, w)};
  const Vector3f& p = point.surface.position_m;
  if (is_flat_enough(p) && p.head<2>().cwiseAbs().maxCoeff() < 0.5f * surfaces_->paper_m) {
    if (const auto measured = surfaces_->field->radiance(p)) {
      point.surface.bsdf = {};
      if (surfaces_->albedo) point.surface.bsdf.diffuse = albedo_near(*surfaces_->albedo, p).array();
      point.before = measured->array();
      return point;
    }
  }
  point.before.setConstant(std::numeric_limits<float>::quiet_NaN());
  return point;
}

RealPoint RayRoom::measured_point(const MeshHit& hit, const Vector3f& w) const {
  const std::uint32_t* corner = &surfaces_->real[hit.mesh].model->indices[3 * std::size_t{hit.triangle}];
  const float weight[3] = {1 - hit.u - hit.v, hit.u, hit.v};
  const MeasuredVertex* vertices[3];
  float known[3], sum = 0;
  for (int k = 0; k < 3; ++k) {
    vertices[k] = &surfaces_->vertices[hit.mesh][corner[k]];
    // At the border of the known part only known vertices count.
    known[k] = vertices[k]->colored ? std::max(weight[k], 1e-6f) : 0;
    sum += known[k];
  }
  RealPoint point;
  SurfaceHit& s = point.surface;
  s.normal.setZero();
  for (int k = 0; k < 3; ++k) {
    const float fraction = sum > 0 ? known[k] / sum : weight[k];
    s.position_m += weight[k] * vertices[k]->position_m;
    s.normal += weight[k] * vertices[k]->normal;
    point.before += fraction * vertices[k]->before;
    s.bsdf.diffuse += fraction * vertices[k]->albedo;
  }
  const RoomFacet& facet = surfaces_->facets[hit.mesh][hit.triangle];
  s.face = facet.normal;
  s.normal.normalize();
  s.face_ray(w);
  if (ends_behind(facet, w)) point.before = modelled_before(s.bsdf.diffuse, s.position_m, s.normal);
  return point;
}

Rgb RayRoom::modelled_before(const Rgb& albedo, const Vector3f& p_m, const Vector3f& normal) const {
  SurfaceHit surface;
  surface.position_m = p_m;
  surface.normal = surface.face = normal;
  return albedo / kPi * unoccluded_irradiance(*illumination_, lamp_samples_, surface);
}

}  // namespace lumigraft::relight
