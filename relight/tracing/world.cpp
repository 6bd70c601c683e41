#include "relight/tracing/world.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "relight/objects/placement.h"
#include "relight/objects/posed_model.h"
#include "relight/tracing/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// The lamp's centre and extremal points.
std::array<Vector3f, 5> points_of(const ReferenceLamp& lamp, const Vector3f& towards_m) {
  Vector3f u = lamp.half_u_m, v = lamp.half_v_m;
  if (lamp.shape == ReferenceLamp::Shape::sphere || lamp.shape == ReferenceLamp::Shape::disc) {
    basis((towards_m - lamp.centre_m).normalized(), u, v);
    u *= lamp.radius_m;
    v *= lamp.radius_m;
  }
  return {lamp.centre_m, lamp.centre_m + u, lamp.centre_m - u, lamp.centre_m + v, lamp.centre_m - v};
}

/// Intersections with the room of rays from the lamp past the sphere's centre and rim.
void add_shadow(const ReferenceLamp& lamp, const Eigen::Vector4f& sphere, const Meshes& real,
                std::vector<Vector3f>& found_m) {
  const Vector3f middle = sphere.head<3>();
  for (const Vector3f& from : points_of(lamp, middle)) {
    const float distance = (middle - from).norm();
    if (distance <= sphere.w()) continue;
    const Vector3f axis = (middle - from) / distance;
    const float rim = cone_of_sphere(sphere.w(), distance);
    for (int i = 0; i <= kTracing.rays_around; ++i) {
      const float turn = static_cast<float>(i) / kTracing.rays_around;
      const Vector3f w = i == 0 ? axis : in_cone(axis, rim, {1, turn});
      const auto hit = real.hit(from + (distance - sphere.w()) * w, w, std::numeric_limits<float>::infinity());
      if (hit) found_m.push_back(from + (distance - sphere.w() + hit->t_m) * w);
    }
  }
}

std::shared_ptr<const ReferenceScene> posed(std::shared_ptr<const ReferenceScene> scene) {
  if (std::ranges::all_of(scene->objects, [](const ReferenceMesh& o) { return o.pose.at_rest(); })) return scene;
  auto now = std::make_shared<ReferenceScene>(*scene);
  for (ReferenceMesh& object : now->objects) {
    object.model = posed_model(object.model, object.pose);
    object.pose = {};
  }
  return now;
}

}  // namespace

std::vector<ChangeRegion> change_regions(const std::vector<ReferenceLamp>& lamps, const Meshes& real,
                                         const Meshes& objects) {
  std::vector<ChangeRegion> places;
  for (const Eigen::Vector4f& sphere : objects.spheres()) {
    places.push_back({sphere.head<3>(), sphere.w(), 1 / static_cast<float>(objects.spheres().size())});
  }
  for (const ReferenceLamp& lamp : lamps) {
    std::vector<Vector3f> shadow_m;
    for (const Eigen::Vector4f& sphere : objects.spheres()) add_shadow(lamp, sphere, real, shadow_m);
    if (shadow_m.empty()) continue;
    const BoundingSphere around = bounding_sphere(shadow_m);
    places.push_back({around.centre_m, kTracing.wider * around.radius_m, 1 / static_cast<float>(lamps.size())});
  }
  return places;
}

TraceWorld::TraceWorld(std::shared_ptr<const ReferenceScene> the_scene)
    : scene(posed(std::move(the_scene))),
      real(scene->real, scene->seen.get()),
      objects(scene->objects, nullptr),
      any_unlit(objects.any_unlit()),
      emitters(scene->objects),
      sky(*scene),
      places(change_regions(scene->lamps, real, objects)) {
  if (!scene->shadows) return;
  for (const ReferenceLamp& lamp : scene->lamps) shadows.push_back(scene->shadows->of(lamp.id));
}

}  // namespace lumigraft::relight
