#include "relight/objects/closest_point.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <stdexcept>

namespace lumigraft::relight {
namespace {

// Nearest point of a triangle to the origin, by the Voronoi region that contains the origin (Ericson 2005, "Real-Time
// Collision Detection", §5.1.5). Returns barycentric weights.
Eigen::Vector3f nearest_to_origin(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const auto on_edge = [](float from, float to) { return from / (from + to); };
  const Eigen::Vector3f ab = b - a, ac = c - a;
  const float ab_a = -ab.dot(a), ac_a = -ac.dot(a);
  if (ab_a <= 0 && ac_a <= 0) return {1, 0, 0};
  const float ab_b = -ab.dot(b), ac_b = -ac.dot(b);
  if (ab_b >= 0 && ac_b <= ab_b) return {0, 1, 0};
  const float region_c = ab_a * ac_b - ab_b * ac_a;
  if (region_c <= 0 && ab_a >= 0 && ab_b <= 0) {
    const float t = on_edge(ab_a, -ab_b);
    return {1 - t, t, 0};
  }
  const float ab_c = -ab.dot(c), ac_c = -ac.dot(c);
  if (ac_c >= 0 && ab_c <= ac_c) return {0, 0, 1};
  const float region_b = ab_c * ac_a - ab_a * ac_c;
  if (region_b <= 0 && ac_a >= 0 && ac_c <= 0) {
    const float t = on_edge(ac_a, -ac_c);
    return {1 - t, 0, t};
  }
  const float region_a = ab_b * ac_c - ab_c * ac_b;
  const float to_c = ac_b - ab_b, to_b = ab_c - ac_c;
  if (region_a <= 0 && to_c >= 0 && to_b >= 0) {
    const float t = on_edge(to_c, to_b);
    return {0, 1 - t, t};
  }
  const float sum = region_a + region_b + region_c;
  return {region_a / sum, region_b / sum, region_c / sum};
}

struct NearestQuery {
  const Model* model;
  ClosestPoint best;
  bool found = false;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<NearestQuery*>(arguments->userPtr);
  const Model& model = *query.model;
  const Eigen::Vector3f p(arguments->query->x, arguments->query->y, arguments->query->z);
  const std::uint32_t* corner = &model.indices[3 * std::size_t{arguments->primID}];
  const Eigen::Vector3f a = model.positions_m[corner[0]] - p, b = model.positions_m[corner[1]] - p,
                        c = model.positions_m[corner[2]] - p;
  const Eigen::Vector3f weights = nearest_to_origin(a, b, c);
  const Eigen::Vector3f offset = weights[0] * a + weights[1] * b + weights[2] * c;
  const float distance = offset.norm();
  const bool nearer = query.found ? distance < query.best.distance_m ||
                                        (distance == query.best.distance_m && arguments->primID < query.best.triangle)
                                  : distance <= arguments->query->radius;
  if (!nearer) return false;
  query.found = true;
  query.best = {distance, arguments->primID, p + offset, weights};
  // Slightly more than the distance, so that triangles at equal distance are still visited and the result does not
  // depend on the order.
  arguments->query->radius = std::min(arguments->query->radius, distance * 1.000001f + 1e-12f);
  return true;
}

struct HitContext {
  RTCIntersectContext embree;  // must be first: Embree returns a pointer to it
  const ObjectSurface::Accept* accept;
};

void filter_hit(const RTCFilterFunctionNArguments* arguments) {
  const auto* context = reinterpret_cast<const HitContext*>(arguments->context);
  const unsigned triangle = RTCHitN_primID(arguments->hit, arguments->N, 0);
  const Eigen::Vector3f normal(RTCHitN_Ng_x(arguments->hit, arguments->N, 0),
                               RTCHitN_Ng_y(arguments->hit, arguments->N, 0),
                               RTCHitN_Ng_z(arguments->hit, arguments->N, 0));
  if (!(*context->accept)(triangle, normal.normalized())) arguments->valid[0] = 0;
}

}  // namespace

struct ObjectSurface::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Scene() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

ObjectSurface::ObjectSurface(const Model& model) : model_(model), scene_(std::make_unique<Scene>()) {
  scene_->device = rtcNewDevice("threads=1");  // deterministic tree
  if (!scene_->device) throw std::runtime_error("Embree has no device");
  scene_->scene = rtcNewScene(scene_->device);
  rtcSetSceneFlags(scene_->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  RTCGeometry geometry = rtcNewGeometry(scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes per vertex, so the positions are copied to a buffer that it pads.
  const std::size_t vertices = model.positions_m.size(), triangles = model.indices.size() / 3;
  void* vertex_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                sizeof(Eigen::Vector3f), vertices);
  void* index_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                               3 * sizeof(std::uint32_t), triangles);
  std::copy(model.positions_m.begin(), model.positions_m.end(), static_cast<Eigen::Vector3f*>(vertex_buffer));
  std::copy(model.indices.begin(), model.indices.end(), static_cast<std::uint32_t*>(index_buffer));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_->scene);
}

ObjectSurface::~ObjectSurface() = default;

std::optional<ClosestPoint> ObjectSurface::nearest(const Eigen::Vector3f& p_m, float radius_m) const {
  NearestQuery found{&model_, {}, false};
  RTCPointQuery query{p_m.x(), p_m.y(), p_m.z(), 0.0f, radius_m};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_->scene, &query, &context, visit_triangle, &found);
  return found.found ? std::optional(found.best) : std::nullopt;
}

std::optional<float> ObjectSurface::first_hit(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction,
                                              float limit_m, const Accept& accept) const {
  HitContext context;
  rtcInitIntersectContext(&context.embree);
  context.embree.filter = filter_hit;
  context.accept = &accept;
  RTCRayHit ray{};
  ray.ray.org_x = origin_m.x();
  ray.ray.org_y = origin_m.y();
  ray.ray.org_z = origin_m.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tfar = limit_m;
  ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context.embree, &ray);
  return ray.hit.geomID != RTC_INVALID_GEOMETRY_ID ? std::optional(ray.ray.tfar) : std::nullopt;
}

}  // namespace lumigraft::relight
