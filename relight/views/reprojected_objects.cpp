#include "relight/views/reprojected_objects.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "relight/gather/delta_light.h"
#include "relight/gather/object_rays.h"
#include "relight/objects/posed_model.h"
#include "relight/tracing/parallel_for.h"
#include "relight/views/view_projection.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

struct RoomDepth {
  const RoomInView& room;
  float operator()(int u, int v) const {
    const ViewSurface& surface = room.at(u, v);
    return surface.known ? surface.depth_m : 0;  // the view may not have looked there: rays find out
  }
};

class ObjectReprojection {
 public:
  ObjectReprojection(const ViewLight& view, const MovedObjects& objects, const RoomInView& room, const CameraRays& eye,
                     const CurrentDepth& depth)
      : view_(view),
        objects_(objects),
        then_(eye.camera.model, view.T_tag_camera),
        eye_then_m_(view.T_tag_camera.translation()),
        pixel_rad_(1 / static_cast<float>(eye.camera.model.fx)),
        blended_(objects.meshes().any_blended()),
        rays_(objects.meshes(), view.traced_room->meshes(), RoomDepth{room}, eye, depth, kLive) {}

  ObjectLayer see() {
    const PixelWindow& window = rays_.window();
    if (window.width <= 0 || window.height <= 0) return {};
    rays_.find();
    const capture::Image<float> empty(window.width, window.height, 1);
    ObjectLayer out{window.left, window.top, capture::Image<float>(window.width, window.height, 3), empty, empty};
    for_each_index(window.height, 1, [&](int v) {
      for (const PixelHits& found : rays_.row(v)) draw(v, found, out);
    });
    return out;
  }

 private:
  static constexpr GatherQuality kLive{.inside = 1, .at_edges = 4};

  struct Light {
    Rgb radiance = Rgb::Zero();  ///< times coverage
    float coverage = 0;
  };

  void draw(int v, const PixelHits& found, ObjectLayer& out) const {
    Light sum;
    float distance_m = 0;
    const auto add = [&](const Vector3f& w, const MeshHit& hit) {
      const Light light = light_of(found.u, v, w, hit);
      sum.radiance += light.radiance;
      sum.coverage += light.coverage;
      if (distance_m == 0) distance_m = hit.t_m;
    };
    if (found.some) add(found.w[0], found.hits[0]);
    int rays = 1;
    if (rays_.is_edge(found.u, v)) {
      rays = kLive.at_edges;
      rays_.trace(v, std::span(&found.u, 1), 1, rays - 1,
                  [&](std::size_t, int, const Vector3f& w, const MeshHit& hit) { add(w, hit); });
    }
    const std::size_t i = rays_.index(found.u, v);
    set_at(out.radiance, i, sum.radiance / static_cast<float>(rays));
    out.coverage.data[i] = sum.coverage / static_cast<float>(rays);
    out.distance_m.data[i] = distance_m;
  }

  Light light_of(int u, int v, const Vector3f& w, const MeshHit& hit) const {
    if (const auto seen = seen_then(objects_.then(hit))) return *seen;
    const SurfaceHit surface = objects_.meshes().surface(hit, w);
    if (surface.unlit) return {surface.opacity * surface.emission, surface.opacity};
    const PlacedModel& placed = view_.placed[hit.mesh];
    const RayObjects::Irradiance e = RayObjects::irradiance_at(*placed.places, view_.irradiance[hit.mesh],
                                                               objects_.normals(hit.mesh), hit, surface.face);
    const Rgb radiance = surface.emission + diffuse_under(surface, w) * (lit(surface, u, v) + e.indirect) / kPi;
    return {surface.opacity * radiance, surface.opacity};
  }

  /// Irradiance of the lamps.
  Rgb lit(const SurfaceHit& surface, int u, int v) const {
    Rgb sum = Rgb::Zero();
    for (const LightSampleSet& lamp : view_.lamps) {
      ShadowRayPacket fan = lamp.from(surface, 4 * (v & 3) + (u & 3));
      fan.keep_first(kShadowRays);
      if (!(fan.all > 0)) continue;
      fan.rays.some &= ~objects_.meshes().blocked(fan.rays);
      fan.rays.some &= ~view_.traced_room->meshes().blocked(fan.rays);
      float arrives = 0;
      for (std::size_t k = 0; k < kShadowRays; ++k) {
        if (fan.rays.some >> k & 1) arrives += fan.weight[k];
      }
      sum += arrives / fan.all * lamp.irradiance(surface);
    }
    return sum;
  }
  static constexpr int kShadowRays = 4;
  static_assert(LightSource::kSets == 16);

  /// Interpolated between the pixels of the view that show this surface; empty: none does.
  std::optional<Light> seen_then(const MovedObjects::Then& then) const {
    const Vector3f& p_m = then.position_m;
    const auto pixel = then_.pixel(p_m);
    if (!pixel) return std::nullopt;
    const capture::Image<float>& coverage = view_.objects.coverage;
    const float x = pixel->x() - static_cast<float>(view_.objects.left),
                y = pixel->y() - static_cast<float>(view_.objects.top);
    if (!(x > -1 && y > -1 && x < static_cast<float>(coverage.width) && y < static_cast<float>(coverage.height)))
      return std::nullopt;
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    const float right = x - static_cast<float>(left), down = y - static_cast<float>(top);
    const Vector3f to_eye = eye_then_m_ - p_m;
    const float allowed_m = kGather.off_px * pixel_rad_ * to_eye.norm();
    // Of both sides of a sheet the view saw the one towards it.
    const Vector3f normal = (then.normal.dot(to_eye) < 0 ? -then.normal : then.normal).stableNormalized();
    Light sum;
    float weights = 0;
    for (int k = 0; k < 4; ++k) {
      const int u = left + (k & 1), v = top + (k >> 1);
      if (u < 0 || v < 0 || u >= coverage.width || v >= coverage.height) continue;
      const std::size_t i = coverage.index(u, v);
      const ViewSurface& surface = view_.object_surfaces[i];
      if (!surface.known || !(coverage.data[i] > 0)) continue;
      if (surface.normal.dot(normal) < kGather.shared_cosine) continue;
      if (std::abs(surface.normal.dot(p_m - surface.position_m)) > allowed_m) continue;
      const float weight = (k & 1 ? right : 1 - right) * (k >> 1 ? down : 1 - down);
      sum.radiance += weight * radiance_at(view_.objects.radiance, i);
      sum.coverage += weight * coverage.data[i];
      weights += weight;
    }
    if (!(weights > kLeast)) return std::nullopt;
    if (!blended_) return Light{sum.radiance / sum.coverage, 1};
    return Light{sum.radiance / weights, sum.coverage / weights};
  }
  static constexpr float kLeast = 1e-3f;  ///< weight of pixels; less may be rounding

  const ViewLight& view_;
  const MovedObjects& objects_;
  ViewProjection then_;
  Vector3f eye_then_m_;
  float pixel_rad_;
  bool blended_;  ///< coverage is that of the view, not of the silhouette alone
  ObjectRays<RoomDepth> rays_;
};

}  // namespace

MovedObjects::MovedObjects(const ViewLight& view, const std::vector<ReferenceMesh>& now, Trees& trees) {
  std::erase_if(trees, [&](const auto& of_model) {
    return std::ranges::find(view.placed, of_model.first, &PlacedModel::at_rest) == view.placed.end();
  });
  std::vector<ReferenceMesh> meshes;
  std::vector<std::shared_ptr<const ModelTree>> trees_now;
  for (std::size_t k = 0; k < now.size(); ++k) {
    const PlacedModel& then = view.placed[k];
    Object& object = objects_.emplace_back();
    object.model_then = then.places->model;
    object.T_tag_model_then = then.T_tag_model;
    object.normals = now[k].T_tag_model.linear().inverse().transpose();
    std::shared_ptr<const Model> model = then.places->model;
    std::shared_ptr<const ModelTree> tree = then.places->tree;
    if (!(now[k].pose == then.pose)) {
      model = posed_model(then.at_rest->model, now[k].pose);
      tree = now[k].pose.at_rest() ? then.at_rest->tree : trees[then.at_rest].at(model, *then.at_rest->tree);
    }
    meshes.push_back({.model = std::move(model),
                      .T_tag_model = now[k].T_tag_model,
                      .material = now[k].material,
                      .white_radiance = now[k].white_radiance});
    trees_now.push_back(std::move(tree));
  }
  meshes_ = std::make_unique<Meshes>(meshes, trees_now);
}

MovedObjects::Then MovedObjects::then(const MeshHit& hit) const {
  const Object& object = objects_[hit.mesh];
  const Model& model = *object.model_then;
  const std::uint32_t* corner = &model.indices[3 * std::size_t{hit.triangle}];
  const Vector3f& first = model.positions_m[corner[0]];
  const Vector3f to_second = object.T_tag_model_then.linear() * (model.positions_m[corner[1]] - first),
                 to_third = object.T_tag_model_then.linear() * (model.positions_m[corner[2]] - first);
  return {object.T_tag_model_then * first + hit.u * to_second + hit.v * to_third, to_second.cross(to_third)};
}

ObjectLayer reprojected_objects(const ViewLight& view, const MovedObjects& objects, const RoomInView& room,
                                const CameraRays& eye, const CurrentDepth& depth) {
  return ObjectReprojection(view, objects, room, eye, depth).see();
}

}  // namespace lumigraft::relight
