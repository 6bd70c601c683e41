#include "relight/tracing/meshes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>

#include "relight/objects/embree_scene.h"
#include "relight/objects/placement.h"
#include "relight/objects/surface_color.h"
#include "relight/tracing/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

struct Placed {
  ReferenceMesh mesh;
  Eigen::Matrix3f normals = Eigen::Matrix3f::Identity();
  std::vector<std::uint32_t> part;  // by triangle; empty if the model has only one
};

void let_through(const RTCFilterFunctionNArguments* found) { std::fill_n(found->valid, found->N, 0); }

Rgb pixel(const capture::Image<float>& image, int u, int v) {
  return {image.at(u, v, 0), image.at(u, v, 1), image.at(u, v, 2)};
}

/// The material of SeenMaterials at a point: at the pixel whose ray hits the surface's plane at the pixel's depth.
std::optional<BsdfParams> seen_bsdf(const SeenMaterials& seen, const Vector3f& p_m, const Vector3f& face) {
  const Vector3f p = seen.T_camera_tag * p_m, n = seen.T_camera_tag.linear() * face;
  if (p.z() <= 0) return std::nullopt;
  const auto at = seen.camera.project(p.cast<double>());
  if (!at || !seen.camera.inside(*at)) return std::nullopt;
  const int u = static_cast<int>(std::lround(at->x())), v = static_cast<int>(std::lround(at->y()));
  const auto ray = seen.camera.unproject({u, v});
  if (!ray) return std::nullopt;
  const Vector3f w = (*ray / ray->z()).cast<float>();
  const float z = n.dot(p) / n.dot(w), depth = seen.depth_m.at(u, v);
  if (!(depth > 0 && std::abs(depth - z) < kTracing.same_depth * depth)) return std::nullopt;
  return bsdf_params_of(pixel(seen.diffuse, u, v), pixel(seen.f0, u, v), seen.alpha.at(u, v));
}

/// `valid`: -1 for an active ray, as Embree requires; the others get harmless values. The rays are coherent, but with
/// Embree's coherent flag (3.13) rtcOccluded16 hung in a scene of instances.
void set_rays(const RayFan& fan, std::array<int, RayFan::kMaxRays>& valid, RTCRay16& rays) {
  const auto some = static_cast<std::size_t>(std::countr_zero(fan.some));
  for (std::size_t i = 0; i < RayFan::kMaxRays; ++i) {
    const bool meant = fan.some >> i & 1;
    const Vector3f& w = fan.w[meant ? i : some];
    valid[i] = meant ? -1 : 0;
    rays.org_x[i] = fan.from_m.x();
    rays.org_y[i] = fan.from_m.y();
    rays.org_z[i] = fan.from_m.z();
    rays.tnear[i] = 0;
    rays.dir_x[i] = w.x();
    rays.dir_y[i] = w.y();
    rays.dir_z[i] = w.z();
    rays.time[i] = 0;
    rays.tfar[i] = meant ? fan.limit_m[i] : -1;
    rays.mask[i] = ~0u;
    rays.id[i] = 0;
    rays.flags[i] = 0;
  }
}

}  // namespace

struct ModelTree::State {
  std::shared_ptr<const Model> model;
  EmbreeScene triangles;
  BoundingSphere sphere;
};

ModelTree::ModelTree(std::shared_ptr<const Model> model) : state_(std::make_unique<State>()) {
  state_->model = std::move(model);
  state_->triangles.add(triangles_of(*state_->model, Eigen::Affine3f::Identity()), 0);
  rtcCommitScene(state_->triangles.scene);
  state_->sphere = bounding_sphere(state_->model->positions_m);
}

ModelTree::~ModelTree() = default;

struct Meshes::State {
  std::vector<Placed> placed;
  std::vector<Eigen::Vector4f> spheres;
  const SeenMaterials* seen = nullptr;
  std::vector<std::shared_ptr<const ModelTree>> trees;
  EmbreeScene all;

  void place(const ReferenceMesh& mesh, const BoundingSphere& around) {
    const Model& model = *mesh.model;
    Placed& p = placed.emplace_back();
    p.mesh = mesh;
    p.normals = mesh.T_tag_model.linear().inverse().transpose();
    if (model.parts.size() > 1) p.part.assign(model.indices.size() / 3, 0);
    for (std::uint32_t i = 1; i < model.parts.size(); ++i) {
      const auto first = p.part.begin() + model.parts[i].first_index / 3;
      std::fill(first, first + model.parts[i].index_count / 3, i);
    }
    spheres.emplace_back(around.centre_m.x(), around.centre_m.y(), around.centre_m.z(), around.radius_m);
  }

  void add(const ReferenceMesh& mesh) {
    std::vector<Vector3f> positions_m;
    for (const Vector3f& x : mesh.model->positions_m) positions_m.push_back(mesh.T_tag_model * x);
    RTCGeometry triangles = triangles_of(*mesh.model, mesh.T_tag_model);
    if (!mesh.hides) {
      rtcSetGeometryOccludedFilterFunction(triangles, let_through);
      rtcCommitGeometry(triangles);
    }
    all.add(triangles, placed.size());
    place(mesh, bounding_sphere(positions_m));
  }

  void add(const ReferenceMesh& mesh, const ModelTree::State& tree) {
    RTCGeometry geometry = rtcNewGeometry(embree_device(), RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, tree.triangles.scene);
    const Eigen::Matrix<float, 3, 4> T = mesh.T_tag_model.affine();
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, T.data());
    rtcCommitGeometry(geometry);
    all.add(geometry, placed.size());
    const Eigen::Matrix3f& linear = mesh.T_tag_model.linear();
    // The sphere becomes an ellipsoid; its longest radius.
    const float scale = std::sqrt((linear.transpose() * linear).selfadjointView<Eigen::Lower>().eigenvalues()[2]);
    place(mesh, {mesh.T_tag_model * tree.sphere.centre_m, scale * tree.sphere.radius_m});
  }

  /// The mesh index, for a mesh in the scene itself or an instance.
  static std::uint32_t mesh_of(unsigned geometry, unsigned instance) {
    return instance == RTC_INVALID_GEOMETRY_ID ? geometry : instance;
  }
};

Meshes::Meshes(const std::vector<ReferenceMesh>& meshes, const SeenMaterials* seen)
    : state_(std::make_unique<State>()) {
  state_->seen = seen;
  for (const ReferenceMesh& mesh : meshes) state_->add(mesh);
  rtcCommitScene(state_->all.scene);
}

Meshes::Meshes(const std::vector<ReferenceMesh>& meshes, const std::vector<std::shared_ptr<const ModelTree>>& trees)
    : state_(std::make_unique<State>()) {
  state_->trees = trees;
  for (std::size_t i = 0; i < meshes.size(); ++i) state_->add(meshes[i], *trees[i]->state_);
  rtcCommitScene(state_->all.scene);
}

Meshes::~Meshes() = default;

bool Meshes::empty() const { return state_->placed.empty(); }
bool Meshes::hides(const MeshHit& hit) const { return state_->placed[hit.mesh].mesh.hides; }
const std::vector<Eigen::Vector4f>& Meshes::spheres() const { return state_->spheres; }

std::optional<MeshHit> Meshes::hit(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = single_ray(from_m, w, limit_m);
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->all.scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return MeshHit{query.ray.tfar, State::mesh_of(query.hit.geomID, query.hit.instID[0]), query.hit.primID, query.hit.u,
                 query.hit.v};
}

bool Meshes::blocked(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = single_ray(from_m, w, limit_m);
  rtcOccluded1(state_->all.scene, &context, &ray);
  return ray.tfar < 0;
}

std::uint32_t Meshes::hits(const RayFan& fan, std::array<MeshHit, RayFan::kMaxRays>& found) const {
  if (fan.some == 0) return 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) std::array<int, RayFan::kMaxRays> valid;
  alignas(64) RTCRayHit16 query;
  set_rays(fan, valid, query.ray);
  std::fill_n(query.hit.geomID, RayFan::kMaxRays, RTC_INVALID_GEOMETRY_ID);
  std::fill_n(query.hit.instID[0], RayFan::kMaxRays, RTC_INVALID_GEOMETRY_ID);
  rtcIntersect16(valid.data(), state_->all.scene, &context, &query);
  std::uint32_t which = 0;
  for (std::size_t i = 0; i < RayFan::kMaxRays; ++i) {
    if (!valid[i] || query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    which |= 1u << i;
    found[i] = {query.ray.tfar[i], State::mesh_of(query.hit.geomID[i], query.hit.instID[0][i]), query.hit.primID[i],
                query.hit.u[i], query.hit.v[i]};
  }
  return which;
}

std::uint32_t Meshes::blocked(const RayFan& fan) const {
  if (fan.some == 0) return 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) std::array<int, RayFan::kMaxRays> valid;
  alignas(64) RTCRay16 rays;
  set_rays(fan, valid, rays);
  rtcOccluded16(valid.data(), state_->all.scene, &context, &rays);
  std::uint32_t which = 0;
  for (std::size_t i = 0; i < RayFan::kMaxRays; ++i) {
    if (valid[i] && rays.tfar[i] < 0) which |= 1u << i;
  }
  return which;
}

SurfaceHit Meshes::surface(const MeshHit& hit, const Vector3f& w) const {
  const Placed& placed = state_->placed[hit.mesh];
  const Model& model = *placed.mesh.model;
  const std::uint32_t* corner = &model.indices[3 * std::size_t{hit.triangle}];
  const auto mixed = [&](const auto& values) {
    return ((1 - hit.u - hit.v) * values[corner[0]] + hit.u * values[corner[1]] + hit.v * values[corner[2]]).eval();
  };
  SurfaceHit s;
  const auto& p = model.positions_m;
  s.position_m = placed.mesh.T_tag_model * mixed(p);
  s.face = (placed.normals * (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]])).stableNormalized();
  s.normal = (placed.normals * mixed(model.normals)).stableNormalized();
  s.face_ray(w);
  if (placed.mesh.seen && state_->seen) {
    if (const std::optional<BsdfParams> bsdf = seen_bsdf(*state_->seen, s.position_m, s.face)) {
      s.bsdf = *bsdf;
      return s;
    }
  }
  const Model::Part& part = model.parts[placed.part.empty() ? 0 : placed.part[hit.triangle]];
  const Material material = placed.mesh.material.over(part.material);
  Rgb base = material.base_color.array();
  if (!placed.mesh.material.base_color) {
    base *= mixed(model.colors).array();
    if (part.base_color_texture) base *= texel(*part.base_color_texture, mixed(model.texcoords)).array();
  }
  s.bsdf = bsdf_params_of(base, material);
  return s;
}

}  // namespace lumigraft::relight
