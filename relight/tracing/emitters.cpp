#include "relight/tracing/emitters.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

std::vector<std::shared_ptr<const EmissiveSurface>> surfaces_of(const std::vector<ReferenceMesh>& meshes) {
  std::vector<std::shared_ptr<const EmissiveSurface>> surfaces;
  for (const ReferenceMesh& mesh : meshes) surfaces.push_back(EmissiveSurface::of(*mesh.model, mesh.material));
  return surfaces;
}

Eigen::Matrix3f cofactor_of(const Eigen::Matrix3f& m) {
  Eigen::Matrix3f cofactor;
  cofactor << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
  return cofactor;
}

}  // namespace

Emitters::Emitters(const std::vector<ReferenceMesh>& meshes) : Emitters(meshes, surfaces_of(meshes)) {}

Emitters::Emitters(const std::vector<ReferenceMesh>& meshes,
                   const std::vector<std::shared_ptr<const EmissiveSurface>>& surfaces) {
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const Eigen::Matrix3f linear = meshes[i].T_tag_model.linear();
    of_mesh_.push_back(
        {surfaces[i], meshes[i].model, meshes[i].T_tag_model, cofactor_of(linear), meshes[i].white_radiance});
    if (!surfaces[i]) continue;
    const float area_scale = std::pow(std::abs(linear.determinant()), 2.0f / 3);
    of_mesh_.back().fraction = surfaces[i]->power() * area_scale * meshes[i].white_radiance;
    power_ += of_mesh_.back().fraction;
  }
  float sum = 0;
  for (Placed& placed : of_mesh_) {
    placed.cumulative = (sum += placed.fraction) / power_;
    placed.fraction /= power_;
  }
}

EmitterPoint Emitters::Placed::placed(const Vector3f& position_m, const Vector3f& normal, const Rgb& emission,
                                      float pdf) const {
  const float determinant = T_tag_model.linear().determinant(), length = normal.norm();
  if (length < 1e-3f) {  // of a patch that faces all directions
    const float area_scale = std::pow(std::abs(determinant), 2.0f / 3);
    return {T_tag_model * position_m, Vector3f::Zero(), white_radiance * emission, pdf / area_scale};
  }
  const Vector3f turned = std::copysign(1.0f, determinant) * (cofactor * normal);
  const float area_scale = turned.norm() / length;
  return {T_tag_model * position_m, turned / area_scale, white_radiance * emission, pdf / area_scale};
}

EmitterPoint Emitters::point(std::size_t mesh, const Eigen::Vector2f& u) const {
  const EmissiveSurface::Point p = of_mesh_[mesh].surface->sample(u);
  EmitterPoint placed = of_mesh_[mesh].placed(p.position_m, p.normal, p.emission, p.pdf);
  placed.clearcoat = p.clearcoat;
  return placed;
}

std::vector<EmitterPoint> Emitters::patches(std::size_t mesh) const {
  std::vector<EmitterPoint> placed;
  for (const EmissiveSurface::Patch& p : of_mesh_[mesh].surface->patches())
    placed.push_back(of_mesh_[mesh].placed(p.position_m, p.normal, p.emission, p.pdf));
  return placed;
}

LightSample Emitters::sample(const Vector3f& from_m, Eigen::Vector2f u) const {
  std::size_t mesh = 0;
  while (mesh + 1 < of_mesh_.size() && (of_mesh_[mesh].fraction <= 0 || u.x() >= of_mesh_[mesh].cumulative)) ++mesh;
  const Placed& placed = of_mesh_[mesh];
  LightSample s;
  if (!placed.surface) return s;
  u.x() = std::clamp((u.x() - placed.cumulative + placed.fraction) / placed.fraction, 0.0f, 0x1.fffffep-1f);
  const EmitterPoint p = point(mesh, u);
  const Vector3f to = p.position_m - from_m;
  s.distance_m = to.norm();
  s.w = to / s.distance_m;
  const float cosine = -p.normal.dot(s.w);
  if (!(cosine > 0)) return s;
  s.radiance = p.radiance * (1 - coat_share(p.clearcoat, cosine));
  s.pdf = placed.fraction * p.pdf * s.distance_m * s.distance_m / cosine;
  return s;
}

float Emitters::pdf(const MeshHit& hit, const Vector3f& w) const {
  return empty() ? 0 : of_mesh_[hit.mesh].fraction * point_pdf(hit, w);
}

float Emitters::point_pdf(const MeshHit& hit, const Vector3f& w) const {
  if (empty() || !emits(hit.mesh)) return 0;
  const Placed& placed = of_mesh_[hit.mesh];
  const float of_model = placed.surface->pdf(hit.triangle);
  if (!(of_model > 0)) return 0;
  const std::uint32_t* corner = &placed.model->indices[3 * std::size_t{hit.triangle}];
  const auto& p = placed.model->positions_m;
  const Vector3f normal =
      placed.cofactor * (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]]).stableNormalized();
  // |cosine| times the factor by which areas grow.
  const float cosine = std::abs(normal.dot(w));
  return cosine > 0 ? of_model * hit.t_m * hit.t_m / cosine : 0;
}

}  // namespace lumigraft::relight
