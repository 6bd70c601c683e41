#include "relight/tracing/meshes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "relight/objects/embree_scene.h"
#include "relight/objects/model_surface.h"
#include "relight/objects/placement.h"
#include "relight/objects/posed_model.h"
#include "relight/tracing/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

struct Placed {
  ReferenceMesh mesh;
  Eigen::Matrix3f normals = Eigen::Matrix3f::Identity();
  float scale = 1;  // of lengths, from the model to the tag frame
  std::shared_ptr<const ModelSurface> surface;
};

/// What the filters of blended surfaces know of a query.
struct Query {
  RTCIntersectContext embree;
  Coverage coverage = Coverage::by_chance;
  FanOcclusion* occlusion = nullptr;  ///< not null: takes what blended layers leave, which then stop no ray

  Query() { rtcInitIntersectContext(&embree); }
};

constexpr std::uint32_t mixed(std::uint32_t x) {  // Wellons 2018, "lowbias32"
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}

/// A ray's identity: 28 bits of its origin and direction, and 4 of its number within a fan.
unsigned ray_id(const Vector3f& from_m, const Vector3f& w, std::uint32_t number = 0) {
  std::uint32_t bits = 0;
  for (const Vector3f* of : {&from_m, &w}) {
    for (int axis = 0; axis < 3; ++axis) bits = mixed(bits ^ std::bit_cast<std::uint32_t>((*of)[axis]));
  }
  return bits << 4 | number;
}

/// From 0 to 1; a ray meets a surface whose opacity is higher. Those of a fan are stratified: the first 2, 4, 8 or 16
/// of them, and any aligned group of 4.
float opacity_threshold(unsigned id, std::uint32_t geometry, std::uint32_t triangle) {
  constexpr std::array<std::uint32_t, 16> kReversed = {0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};
  const std::uint32_t turned = mixed((id >> 4) ^ mixed(triangle ^ mixed(geometry))) + (kReversed[id & 15] << 28);
  return static_cast<float>(turned >> 8) * 0x1p-24f;
}

/// Filter of a geometry with blended parts, whose user data is its ModelSurface.
void meet_layers(const RTCFilterFunctionNArguments* found) {
  const Query& query = *reinterpret_cast<const Query*>(found->context);
  if (query.coverage == Coverage::full) return;
  const auto& surface = *static_cast<const ModelSurface*>(found->geometryUserPtr);
  const unsigned n = found->N;
  for (unsigned i = 0; i < n; ++i) {
    if (found->valid[i] != -1) continue;
    const unsigned triangle = RTCHitN_primID(found->hit, n, i), id = RTCRayN_id(found->ray, n, i);
    const float opacity = surface.opacity(triangle, RTCHitN_u(found->hit, n, i), RTCHitN_v(found->hit, n, i));
    if (opacity >= 1) continue;
    if (query.occlusion) {
      found->valid[i] = 0;
      if (!(opacity > 0)) continue;
      const unsigned ray = id & 15;
      query.occlusion->open[ray] *= 1 - opacity;
      query.occlusion->some |= 1u << ray;
      query.occlusion->nearest_m[ray] = std::min(query.occlusion->nearest_m[ray], RTCRayN_tfar(found->ray, n, i));
    } else {
      const unsigned instance = RTCHitN_instID(found->hit, n, i, 0);
      const unsigned geometry = instance == RTC_INVALID_GEOMETRY_ID ? RTCHitN_geomID(found->hit, n, i) : instance;
      if (opacity_threshold(id, geometry, triangle) >= opacity) found->valid[i] = 0;
    }
  }
}

bool blends(const Model& model) { return std::ranges::any_of(model.parts, &Model::Part::blends); }

/// Before the geometry is committed. `surface` stays where it is.
void meet_layers_of(RTCGeometry triangles, const ModelSurface& surface, const Model& model) {
  if (!blends(model)) return;
  rtcSetGeometryUserData(triangles, const_cast<ModelSurface*>(&surface));
  rtcSetGeometryIntersectFilterFunction(triangles, meet_layers);
  rtcSetGeometryOccludedFilterFunction(triangles, meet_layers);
}

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

/// `told_apart`: by ray_id. `valid`: -1 for an active ray, as Embree requires; the others get harmless values. The rays
/// are coherent, but with Embree's coherent flag (3.13) rtcOccluded16 hung in a scene of instances.
void set_rays(const RayFan& fan, bool told_apart, std::array<int, RayFan::kMaxRays>& valid, RTCRay16& rays) {
  const auto some = static_cast<std::size_t>(std::countr_zero(fan.some));
  const unsigned id = told_apart ? ray_id(fan.from_m, fan.w[some]) : 0;
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
    rays.id[i] = id | static_cast<unsigned>(i);
    rays.flags[i] = 0;
  }
}

}  // namespace

struct ModelTree::State {
  std::shared_ptr<const Model> model;
  std::shared_ptr<const ModelSurface> surface;
  EmbreeScene triangles;
  BoundingSphere sphere;

  explicit State(int flags = RTC_SCENE_FLAG_NONE) : triangles(flags) {}

  void take_pose(std::shared_ptr<const Model> posed, const ModelSurface& of_another) {
    model = std::move(posed);
    surface = std::make_shared<ModelSurface>(*model, of_another);
    sphere = bounding_sphere(model->positions_m);
  }
};

ModelTree::ModelTree(std::shared_ptr<const Model> model) : state_(std::make_unique<State>()) {
  state_->model = std::move(model);
  state_->surface = std::make_shared<ModelSurface>(*state_->model, /*mips=*/true);
  RTCGeometry triangles = triangles_of(*state_->model, Eigen::Affine3f::Identity());
  meet_layers_of(triangles, *state_->surface, *state_->model);
  rtcCommitGeometry(triangles);
  state_->triangles.add(triangles, 0);
  rtcCommitScene(state_->triangles.scene);
  state_->sphere = bounding_sphere(state_->model->positions_m);
}

ModelTree::ModelTree(std::shared_ptr<const Model> posed, const ModelTree& at_rest)
    : state_(std::make_unique<State>(RTC_SCENE_FLAG_DYNAMIC)) {
  state_->take_pose(std::move(posed), *at_rest.state_->surface);
  RTCGeometry triangles = triangles_of(*state_->model, Eigen::Affine3f::Identity());
  rtcSetGeometryBuildQuality(triangles, RTC_BUILD_QUALITY_REFIT);
  meet_layers_of(triangles, *state_->surface, *state_->model);
  rtcCommitGeometry(triangles);
  state_->triangles.add(triangles, 0);
  rtcCommitScene(state_->triangles.scene);
}

void ModelTree::refit(std::shared_ptr<const Model> posed) {
  state_->take_pose(std::move(posed), ModelSurface(*state_->surface));
  RTCGeometry triangles = rtcGetGeometry(state_->triangles.scene, 0);
  std::ranges::copy(state_->model->positions_m,
                    static_cast<Vector3f*>(rtcGetGeometryBufferData(triangles, RTC_BUFFER_TYPE_VERTEX, 0)));
  rtcUpdateGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0);
  meet_layers_of(triangles, *state_->surface, *state_->model);
  rtcCommitGeometry(triangles);
  rtcCommitScene(state_->triangles.scene);
}

std::shared_ptr<const ModelTree> PosedTrees::at(std::shared_ptr<const Model> posed, const ModelTree& at_rest) {
  const auto unused = std::ranges::find_if(trees_, [](const auto& tree) { return tree.use_count() == 1; });
  if (unused == trees_.end()) return trees_.emplace_back(std::make_shared<ModelTree>(std::move(posed), at_rest));
  (*unused)->refit(std::move(posed));
  return *unused;
}

ModelTree::~ModelTree() = default;

struct Meshes::State {
  std::vector<Placed> placed;
  std::vector<Eigen::Vector4f> spheres;
  const SeenMaterials* seen = nullptr;
  std::vector<std::shared_ptr<const ModelTree>> trees;
  EmbreeScene all;
  bool blended = false;

  void place(const ReferenceMesh& mesh, std::shared_ptr<const ModelSurface> surface, const BoundingSphere& around) {
    const Eigen::Matrix3f linear = mesh.T_tag_model.linear();
    placed.push_back(
        {mesh, linear.inverse().transpose(), std::cbrt(std::abs(linear.determinant())), std::move(surface)});
    blended = blended || blends(*mesh.model);
    spheres.emplace_back(around.centre_m.x(), around.centre_m.y(), around.centre_m.z(), around.radius_m);
  }

  void add(ReferenceMesh mesh) {
    mesh.model = posed_model(mesh.model, mesh.pose);
    std::vector<Vector3f> positions_m;
    for (const Vector3f& x : mesh.model->positions_m) positions_m.push_back(mesh.T_tag_model * x);
    RTCGeometry triangles = triangles_of(*mesh.model, mesh.T_tag_model);
    const auto surface = std::make_shared<ModelSurface>(*mesh.model, /*mips=*/false);
    meet_layers_of(triangles, *surface, *mesh.model);
    if (!mesh.hides) rtcSetGeometryOccludedFilterFunction(triangles, let_through);
    rtcCommitGeometry(triangles);
    all.add(triangles, placed.size());
    place(mesh, surface, bounding_sphere(positions_m));
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
    place(mesh, tree.surface, {mesh.T_tag_model * tree.sphere.centre_m, scale * tree.sphere.radius_m});
  }

  /// The mesh index, for a mesh in the scene itself or an instance.
  static std::uint32_t mesh_of(unsigned geometry, unsigned instance) {
    return instance == RTC_INVALID_GEOMETRY_ID ? geometry : instance;
  }

  std::optional<MeshHit> nearest(Query& query, RTCRayHit& ray) const {
    ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(all.scene, &query.embree, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return MeshHit{ray.ray.tfar, mesh_of(ray.hit.geomID, ray.hit.instID[0]), ray.hit.primID, ray.hit.u, ray.hit.v};
  }

  /// As Meshes::hits.
  std::uint32_t nearest(Query& query, const RayFan& fan, std::array<MeshHit, RayFan::kMaxRays>& found) const {
    alignas(64) std::array<int, RayFan::kMaxRays> valid;
    alignas(64) RTCRayHit16 rays;
    set_rays(fan, blended, valid, rays.ray);
    std::fill_n(rays.hit.geomID, RayFan::kMaxRays, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(rays.hit.instID[0], RayFan::kMaxRays, RTC_INVALID_GEOMETRY_ID);
    rtcIntersect16(valid.data(), all.scene, &query.embree, &rays);
    std::uint32_t which = 0;
    for (std::size_t i = 0; i < RayFan::kMaxRays; ++i) {
      if (!valid[i] || rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      which |= 1u << i;
      found[i] = {rays.ray.tfar[i], mesh_of(rays.hit.geomID[i], rays.hit.instID[0][i]), rays.hit.primID[i],
                  rays.hit.u[i], rays.hit.v[i]};
    }
    return which;
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
bool Meshes::transmits(std::uint32_t mesh) const {
  const ReferenceMesh& placed = state_->placed[mesh].mesh;
  return std::ranges::any_of(placed.model->parts, [&](const Model::Part& part) {
    const Material material = placed.material.over(part.material);
    return material.transmission > 0 && material.metallic < 1;
  });
}
bool Meshes::any_unlit() const {
  return std::ranges::any_of(state_->placed, [](const Placed& placed) {
    return std::ranges::any_of(placed.mesh.model->parts,
                               [&](const Model::Part& part) { return placed.mesh.material.over(part.material).unlit; });
  });
}
bool Meshes::any_blended() const { return state_->blended; }
const std::vector<Eigen::Vector4f>& Meshes::spheres() const { return state_->spheres; }

std::optional<MeshHit> Meshes::hit(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  Query query;
  RTCRayHit nearest{};
  nearest.ray = single_ray(from_m, w, limit_m);
  if (state_->blended) nearest.ray.id = ray_id(from_m, w);
  return state_->nearest(query, nearest);
}

std::optional<MeshHit> Meshes::hit_beyond(float t_m, const Vector3f& from_m, const Vector3f& w) const {
  Query query;
  query.coverage = Coverage::full;
  RTCRayHit nearest{};
  nearest.ray = single_ray(from_m, w, std::numeric_limits<float>::infinity());
  nearest.ray.tnear = t_m * (1 + kTracing.between_layers);
  return state_->nearest(query, nearest);
}

bool Meshes::blocked(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  Query query;
  RTCRay ray = single_ray(from_m, w, limit_m);
  if (state_->blended) ray.id = ray_id(from_m, w);
  rtcOccluded1(state_->all.scene, &query.embree, &ray);
  return ray.tfar < 0;
}

std::uint32_t Meshes::hits(const RayFan& fan, std::array<MeshHit, RayFan::kMaxRays>& found, Coverage coverage) const {
  if (fan.some == 0) return 0;
  Query query;
  query.coverage = coverage;
  return state_->nearest(query, fan, found);
}

FanOcclusion Meshes::occlusion(const RayFan& fan) const {
  FanOcclusion occlusion;
  occlusion.open.fill(1);
  if (fan.some == 0) return occlusion;
  occlusion.nearest_m.fill(std::numeric_limits<float>::infinity());
  Query query;
  query.occlusion = &occlusion;
  std::array<MeshHit, RayFan::kMaxRays> found;
  const std::uint32_t closed = state_->nearest(query, fan, found);
  occlusion.some |= closed;
  for (std::size_t i = 0; i < RayFan::kMaxRays; ++i) {
    if (!(closed >> i & 1)) continue;
    occlusion.open[i] = 0;
    occlusion.nearest_m[i] = std::min(occlusion.nearest_m[i], found[i].t_m);
  }
  return occlusion;
}

std::uint32_t Meshes::blocked(const RayFan& fan) const {
  if (fan.some == 0) return 0;
  Query query;
  alignas(64) std::array<int, RayFan::kMaxRays> valid;
  alignas(64) RTCRay16 rays;
  set_rays(fan, state_->blended, valid, rays);
  rtcOccluded16(valid.data(), state_->all.scene, &query.embree, &rays);
  std::uint32_t which = 0;
  for (std::size_t i = 0; i < RayFan::kMaxRays; ++i) {
    if (valid[i] && rays.tfar[i] < 0) which |= 1u << i;
  }
  return which;
}

namespace {

/// Edge of a square with the area of a ray's footprint on a surface.
float footprint_m(const MeshHit& hit, float cosine, float pixel_rad) {
  return pixel_rad * hit.t_m / std::sqrt(std::max(std::abs(cosine), kTracing.min_footprint_cosine));
}

}  // namespace

bool Meshes::textured(const MeshHit& hit) const { return state_->placed[hit.mesh].surface->textured(hit.triangle); }

SurfaceHit Meshes::surface(const MeshHit& hit, const Vector3f& w, float pixel_rad) const {
  return surface(hit, w, pixel_rad, nullptr);
}

SurfaceHit Meshes::surface(const MeshHit& hit, const Vector3f& w, const RayCell& cell) const {
  return surface(hit, w, 0, &cell);
}

SurfaceHit Meshes::surface(const MeshHit& hit, const Vector3f& w, float pixel_rad, const RayCell* cell) const {
  const Placed& placed = state_->placed[hit.mesh];
  const Model& model = *placed.mesh.model;
  const std::uint32_t* corner = &model.indices[3 * std::size_t{hit.triangle}];
  const Vector3f barycentric(1 - hit.u - hit.v, hit.u, hit.v);
  const auto& p = model.positions_m;
  SurfaceHit s;
  s.position_m = placed.mesh.T_tag_model *
                 (barycentric[0] * p[corner[0]] + barycentric[1] * p[corner[1]] + barycentric[2] * p[corner[2]]);
  s.face = (placed.normals * (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]])).stableNormalized();
  ModelPoint point{hit.triangle, barycentric, footprint_m(hit, s.face.dot(w), pixel_rad) / placed.scale};
  if (cell) {
    // Where a ray in a direction that differs by d ends in the plane: t (d - w (n·d) / (n·w)) away.
    const float cosine = std::copysign(std::max(std::abs(s.face.dot(w)), kTracing.min_footprint_cosine), s.face.dot(w));
    const Eigen::Matrix3f onto_plane = hit.t_m * (Eigen::Matrix3f::Identity() - w * s.face.transpose() / cosine);
    const Eigen::Matrix3f in_model = placed.mesh.T_tag_model.linear().transpose() / (placed.scale * placed.scale);
    point.cell = {in_model * (onto_plane * cell->to_centre), in_model * (onto_plane * cell->edges)};
  }
  const ModelSurface::Shading shading = placed.surface->at(point, placed.mesh.material);
  const Vector3f interpolated = (placed.normals * shading.interpolated).stableNormalized();
  s.normal = interpolated;
  const bool front = interpolated.dot(s.face) * s.face.dot(w) < 0;
  s.unlit = shading.material.unlit;
  s.opacity = shading.opacity;
  if (front || s.unlit)
    s.emission = placed.mesh.white_radiance * (s.unlit ? shading.material.base_color : shading.material.emission);
  s.face_ray(w);
  const bool flipped = s.face.dot(interpolated) < 0;
  /// One of a map, on the side of the ray's origin; `otherwise`: where it faces away from there.
  const auto turned = [&](const Vector3f& by_map, const Vector3f& otherwise) -> Vector3f {
    const Vector3f out = (placed.normals * by_map).stableNormalized() * (flipped ? -1.0f : 1.0f);
    return out.dot(w) < 0 ? out : otherwise;
  };
  if (shading.normal != shading.interpolated) s.normal = turned(shading.normal, s.normal);
  if (placed.mesh.seen && state_->seen) {
    if (const std::optional<BsdfParams> bsdf = seen_bsdf(*state_->seen, s.position_m, s.face)) {
      s.bsdf = *bsdf;
      return s;
    }
  }
  s.bsdf = bsdf_params_of(shading.material.base_color, shading.material, front);
  if (s.bsdf.coat > 0) {
    s.bsdf.coat_normal = turned(shading.coat_normal, s.face);
    s.emission *= 1 - coat_share(s.bsdf.coat, -s.face.dot(w));  // as Emitters::sample
  }
  if (s.bsdf.stretch > 1) s.bsdf.along = placed.mesh.T_tag_model.linear() * shading.rough_along;
  s.bounds_volume = s.bsdf.transmits() && !shading.material.thin_walled;
  if (s.bounds_volume && front) {
    // Of the model's own materials, the distance is the model's.
    const float scale = placed.mesh.material.attenuation_distance_m ? 1 : placed.scale;
    s.absorption_beyond = absorption_of(shading.material) / scale;
  }
  return s;
}

SurfaceHit Meshes::surface_within(const MeshHit& hit, const Vector3f& w, float solid_angle_sr) const {
  const Placed& placed = state_->placed[hit.mesh];
  const float pixel_rad = std::sqrt(solid_angle_sr);
  SurfaceHit s = surface(hit, w, pixel_rad);
  const float edge_m = footprint_m(hit, s.face.dot(w), pixel_rad) / placed.scale;
  const float variance = edge_m * edge_m * placed.surface->normal_variance(hit.triangle);
  const auto widen = [&](float& alpha) {
    alpha = alpha_with(alpha, variance);
    // A lobe of GGX reflects into about 4π α² sr: half of its normals are within tan θ = α, reflections within 2 θ.
    alpha = std::clamp(std::sqrt(solid_angle_sr / (4 * kPi)), alpha, 1.0f);
  };
  float along = s.bsdf.alphas().x();
  widen(along);
  widen(s.bsdf.alpha);
  s.bsdf.stretch = along / s.bsdf.alpha;
  if (s.bsdf.coat > 0) widen(s.bsdf.coat_alpha);
  return s;
}

}  // namespace lumigraft::relight
