#include "relight/objects/closest_point.h"

#include <algorithm>

#include "reconstruct/field/real_surface_mesh.h"
#include "relight/objects/embree_scene.h"

namespace lumigraft::relight {
namespace {

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
  const Eigen::Vector3f weights = reconstruct::nearest_to_origin(a, b, c);
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

ObjectSurface::ObjectSurface(const Model& model)
    : model_(model), scene_(std::make_unique<EmbreeScene>(RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION)) {
  scene_->add(triangles_of(model, Eigen::Affine3f::Identity()), 0);
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
  ray.ray = single_ray(origin_m, direction, limit_m);
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context.embree, &ray);
  return ray.hit.geomID != RTC_INVALID_GEOMETRY_ID ? std::optional(ray.ray.tfar) : std::nullopt;
}

}  // namespace lumigraft::relight
