#include "relight/reference/meshes.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "capture/response.h"
#include "relight/placement.h"

namespace lumigraft::reference {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kSameDepth = 0.004f;  // of the depth: a pixel shows the point when its depth is as near

struct Placed {
  ReferenceMesh mesh;
  std::vector<Vector3f> positions_m;
  Eigen::Matrix3f normals = Eigen::Matrix3f::Identity();
  std::vector<std::uint32_t> part;  // by triangle
};

/// sRGB texture, bilinear between texel centres; repeats.
Rgb texel(const Image<std::uint8_t>& texture, const Vector2f& uv) {
  const float x = (uv.x() - std::floor(uv.x())) * static_cast<float>(texture.width) - 0.5f;
  const float y = (uv.y() - std::floor(uv.y())) * static_cast<float>(texture.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  Rgb sum = Rgb::Zero();
  for (int i = 0; i < 4; ++i) {
    const int u = (x0 + (i & 1) + texture.width) % texture.width;
    const int v = (y0 + (i >> 1) + texture.height) % texture.height;
    const float share = (i & 1 ? fx : 1 - fx) * (i >> 1 ? fy : 1 - fy);
    for (int c = 0; c < 3; ++c) sum[c] += share * srgb_to_linear(static_cast<float>(texture.at(u, v, c)) / 255);
  }
  return sum;
}

Rgb pixel(const Image<float>& image, int u, int v) { return {image.at(u, v, 0), image.at(u, v, 1), image.at(u, v, 2)}; }

/// The material that the picture shows at a point: where its pixel's own ray meets the surface's plane at the depth
/// that the pixel has.
std::optional<Look> seen_look(const SeenMaterials& seen, const Vector3f& p_m, const Vector3f& face) {
  const Vector3f p = seen.T_camera_tag * p_m, n = seen.T_camera_tag.linear() * face;
  if (p.z() <= 0) return std::nullopt;
  const auto at = seen.camera.project(p.cast<double>());
  if (!at || !seen.camera.inside(*at)) return std::nullopt;
  const int u = static_cast<int>(std::lround(at->x())), v = static_cast<int>(std::lround(at->y()));
  const auto ray = seen.camera.unproject({u, v});
  if (!ray) return std::nullopt;
  const Vector3f w = (*ray / ray->z()).cast<float>();
  const float z = n.dot(p) / n.dot(w), depth = seen.depth_m.at(u, v);
  if (!(depth > 0 && std::abs(depth - z) < kSameDepth * depth)) return std::nullopt;
  return look_of(pixel(seen.diffuse, u, v), pixel(seen.f0, u, v), seen.alpha.at(u, v));
}

}  // namespace

struct Meshes::State {
  std::vector<Placed> placed;
  std::vector<Eigen::Vector4f> spheres;
  const SeenMaterials* seen = nullptr;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  void add(const ReferenceMesh& mesh) {
    const Model& model = *mesh.model;
    Placed p;
    p.mesh = mesh;
    p.normals = mesh.T_tag_model.linear().inverse().transpose();
    for (const Vector3f& x : model.positions_m) p.positions_m.push_back(mesh.T_tag_model * x);
    p.part.assign(model.indices.size() / 3, 0);
    for (std::uint32_t i = 0; i < model.parts.size(); ++i) {
      const auto first = p.part.begin() + model.parts[i].first_index / 3;
      std::fill(first, first + model.parts[i].index_count / 3, i);
    }
    const BoundingSphere around = bounding_sphere(p.positions_m);
    spheres.emplace_back(around.centre_m.x(), around.centre_m.y(), around.centre_m.z(), around.radius_m);

    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree reads 16 bytes at each vertex, so the positions are copied into a buffer that it pads.
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vector3f),
                                             p.positions_m.size());
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), model.indices.size() / 3);
    std::copy(p.positions_m.begin(), p.positions_m.end(), static_cast<Vector3f*>(vertices));
    std::copy(model.indices.begin(), model.indices.end(), static_cast<std::uint32_t*>(indices));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, static_cast<unsigned>(placed.size()));
    rtcReleaseGeometry(geometry);
    placed.push_back(std::move(p));
  }
};

Meshes::Meshes(const std::vector<ReferenceMesh>& meshes, const SeenMaterials* seen)
    : state_(std::make_unique<State>()) {
  state_->seen = seen;
  state_->device = rtcNewDevice("threads=1");  // the same tree each time
  if (!state_->device) throw std::runtime_error("Embree has no device");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  for (const ReferenceMesh& mesh : meshes) state_->add(mesh);
  rtcCommitScene(state_->scene);
}

Meshes::~Meshes() = default;

bool Meshes::empty() const { return state_->placed.empty(); }
const std::vector<Eigen::Vector4f>& Meshes::spheres() const { return state_->spheres; }

std::optional<MeshHit> Meshes::hit(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = {from_m.x(), from_m.y(), from_m.z(), 0, w.x(), w.y(), w.z(), 0, limit_m, ~0u, 0, 0};
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return MeshHit{query.ray.tfar, query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v};
}

bool Meshes::blocked(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray{from_m.x(), from_m.y(), from_m.z(), 0, w.x(), w.y(), w.z(), 0, limit_m, ~0u, 0, 0};
  rtcOccluded1(state_->scene, &context, &ray);
  return ray.tfar < 0;
}

Surface Meshes::surface(const MeshHit& hit, const Vector3f& w) const {
  const Placed& placed = state_->placed[hit.mesh];
  const Model& model = *placed.mesh.model;
  const std::uint32_t* corner = &model.indices[3 * std::size_t{hit.triangle}];
  const auto mixed = [&](const auto& values) {
    return ((1 - hit.u - hit.v) * values[corner[0]] + hit.u * values[corner[1]] + hit.v * values[corner[2]]).eval();
  };
  Surface s;
  const auto& p = placed.positions_m;
  s.position_m = mixed(p);
  s.face = (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]]).stableNormalized();
  s.normal = (placed.normals * mixed(model.normals)).stableNormalized();
  if (s.face.dot(w) > 0) s.face = -s.face;
  if (s.normal.dot(s.face) < 0) s.normal = -s.normal;
  if (!(s.normal.dot(w) < 0)) s.normal = s.face;  // a smooth normal that can't be seen from here

  if (placed.mesh.seen && state_->seen) {
    if (const std::optional<Look> look = seen_look(*state_->seen, s.position_m, s.face)) {
      s.look = *look;
      return s;
    }
  }
  if (placed.mesh.material) {
    s.look = look_of(placed.mesh.material->base_color.array(), *placed.mesh.material);
    return s;
  }
  const Model::Part& part = model.parts[placed.part[hit.triangle]];
  Rgb base = part.material.base_color.array() * mixed(model.colors).array();
  if (part.base_color_texture) base *= texel(*part.base_color_texture, mixed(model.texcoords));
  s.look = look_of(base, part.material);
  return s;
}

}  // namespace lumigraft::reference
