#include "tests/bench/comparators/instant_radiosity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "relight/tracing/vertex.h"
#include "tests/bench/comparators/composition.h"
#include "tests/bench/comparators/imperfect_shadow_map.h"

namespace lumigraft::comparators {
namespace {

using Eigen::Vector3f;
using relight::LightSample;
using relight::PathVertex;
using relight::Sampler;
using relight::TraceWorld;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kShort_m = 1e-4f;  // rays end this far before the lamp
constexpr float kBound = 4;        // of squared distances, relative to the lights' mean square distance
constexpr int kSpread = 8;         // pool of points, as a multiple of a map's

/// A virtual light and its shadow maps.
struct Lit {
  LightPair pair;
  ImperfectShadowMap without, with;
  bool same = false;  ///< in both scenes
};

class Renderer {
 public:
  Renderer(const relight::TraceWorld& world, const InstantRadiosityOptions& options)
      : world_(world), options_(options) {
    for (int i = 0; i < options.sky_rays; ++i) {
      relight::Sampler sampler(options.seed, 2, static_cast<std::uint32_t>(i));
      relight::LightSample s;
      if (world.sky.is_picture()) {
        s = world.sky.sample(sampler.two());
      } else {
        s.w = relight::in_cone(Vector3f::UnitZ(), 2, sampler.two());
        s.radiance = world.sky.radiance(s.w);
        s.pdf = 1 / (4 * relight::kPi);
      }
      s.distance_m = kInfinity;
      if (s.pdf > 0 && s.radiance.maxCoeff() > 0) sky_.push_back(s);
    }
    make_lights();
  }

  struct Light {
    bool on_object = false, seen = false;
    relight::Rgb light = relight::Rgb::Zero();
  };
  Light pixel(const Vector3f& from_m, const Vector3f& w, std::uint32_t number) const {
    float limit_m = kInfinity;
    for (const relight::ReferenceLamp& lamp : world_.scene->lamps) {
      if (const auto t = relight::lamp_hit(lamp, from_m, w)) limit_m = std::min(limit_m, *t);
    }
    const auto real = world_.real.hit(from_m, w, limit_m);
    if (real) limit_m = real->t_m;
    if (const auto object = world_.objects.hit(from_m, w, limit_m)) {
      const relight::PathVertex vertex(world_.objects.surface(*object, w), w);
      return {true, true, direct(vertex, number, true) + indirect(vertex, true)};
    }
    if (!real) return {};
    const relight::PathVertex vertex(world_.real.surface(*real, w), w);
    return {false, true, direct(vertex, number, false) + indirect(vertex, false)};
  }

 private:
  void make_lights() {
    const auto per_map = static_cast<std::size_t>(options_.real_points);
    const auto per_object_map = static_cast<std::size_t>(options_.object_points);
    const ScenePoints real = scatter_points(world_.scene->real, kSpread * options_.real_points, options_.seed);
    const ScenePoints objects = scatter_points(world_.scene->objects, kSpread * options_.object_points, options_.seed);
    Vector3f mean = Vector3f::Zero();
    float mean_square = 0, count = 0;
    for (LightPair& pair : trace_virtual_lights(world_, options_.light_paths, options_.bounces, options_.seed)) {
      Lit& lit = lights_.emplace_back(
          Lit{std::move(pair), ImperfectShadowMap(options_.map_edge), ImperfectShadowMap(options_.map_edge)});
      const std::size_t n = lights_.size();
      const auto& [without, with] = lit.pair;
      lit.same = without && with && *without == *with;
      if (without) {
        lit.without.clear(*without);
        lit.without.draw(real, n * per_map, per_map);
        if (lit.same) lit.with = lit.without;
        lit.without.fill_holes();
        mean += without->position_m;
        mean_square += without->position_m.squaredNorm();
        ++count;
      }
      if (with) {
        if (!lit.same) {
          lit.with.clear(*with);
          lit.with.draw(real, n * per_map, per_map);
        }
        lit.with.draw(objects, n * per_object_map, per_object_map);
        lit.with.fill_holes();
      }
    }
    if (count > 0) min_m2_ = kBound * (mean_square / count - (mean / count).squaredNorm()) / count;
  }

  relight::Rgb direct(const relight::PathVertex& vertex, std::uint32_t number, bool on_object) const {
    relight::Rgb sum = relight::Rgb::Zero();
    const Vector3f from_m = vertex.leave();
    // On an object: the arriving light. On the room: minus the light that no longer arrives.
    const auto add = [&](const relight::LightSample& s, float rays) {
      if (!(s.pdf > 0) || s.radiance.maxCoeff() <= 0) return;
      const relight::Rgb f = vertex.response(s.w);
      if (f.maxCoeff() <= 0) return;
      const float limit_m = s.distance_m - kShort_m;
      if (world_.objects.blocked(from_m, s.w, limit_m) == on_object || world_.real.blocked(from_m, s.w, limit_m))
        return;
      const relight::Rgb light = f * s.radiance / (s.pdf * rays);
      sum += on_object ? light : (-light).eval();
    };
    for (int i = 0; i < options_.lamp_rays; ++i) {
      relight::Sampler sampler(options_.seed, number, static_cast<std::uint32_t>(i));
      for (const relight::ReferenceLamp& lamp : world_.scene->lamps) {
        add(relight::sample_lamp(lamp, from_m, sampler.two()), static_cast<float>(options_.lamp_rays));
      }
    }
    for (const relight::LightSample& s : sky_) add(s, static_cast<float>(options_.sky_rays));
    return sum;
  }

  relight::Rgb indirect(const relight::PathVertex& vertex, bool on_object) const {
    relight::Rgb sum = relight::Rgb::Zero();
    const Vector3f from_m = vertex.leave();
    for (const Lit& lit : lights_) {
      const auto& [without, with] = lit.pair;
      if (on_object) {
        if (with) sum += brought(vertex, from_m, *with, [&] { return lit.with.open(from_m) ? 1.0f : 0.0f; });
      } else if (lit.same) {
        sum += brought(vertex, from_m, *with, [&] {
          return (lit.with.open(from_m) ? 1.0f : 0.0f) - (lit.without.open(from_m) ? 1.0f : 0.0f);
        });
      } else {
        if (with) sum += brought(vertex, from_m, *with, [&] { return lit.with.open(from_m) ? 1.0f : 0.0f; });
        if (without) sum -= brought(vertex, from_m, *without, [&] { return lit.without.open(from_m) ? 1.0f : 0.0f; });
      }
    }
    return sum;
  }

  /// Multiplied by `visibility`, which is evaluated only where there is light.
  template <typename Visibility>
  relight::Rgb brought(const relight::PathVertex& vertex, const Vector3f& from_m, const VirtualLight& light,
                       Visibility visibility) const {
    const Vector3f to = light.position_m - from_m;
    const float square = to.squaredNorm();
    const Vector3f w = to / std::sqrt(std::max(square, 1e-12f));
    const float cosine = -light.normal.dot(w);
    if (!(cosine > 0)) return relight::Rgb::Zero();
    const float part = visibility();
    if (part == 0) return relight::Rgb::Zero();
    return light.intensity * vertex.response(w) * (part * cosine / std::max(square, min_m2_));
  }

  const relight::TraceWorld& world_;
  InstantRadiosityOptions options_;
  std::vector<relight::LightSample> sky_;
  std::vector<Lit> lights_;
  float min_m2_ = 0;  ///< lower bound of the squared distance: the area that a virtual light represents, over π
};

}  // namespace

relight::ReferencePicture instant_radiosity(const std::shared_ptr<const relight::ReferenceScene>& scene,
                                            const relight::PosedCamera& camera,
                                            const InstantRadiosityOptions& options) {
  const relight::TraceWorld world(scene);
  const Renderer renderer(world, options);
  const int width = camera.model.width, height = camera.model.height;
  relight::ReferencePicture picture{capture::Image<float>(width, height, 3), capture::Image<float>(width, height, 3),
                                    capture::Image<float>(width, height, 1)};
  const Vector3f from_m = camera.T_tag_camera.translation();
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const auto w = ray_through(camera, u, v);
      if (!w) continue;
      const auto [on_object, seen, light] = renderer.pixel(from_m, *w, 3 + static_cast<std::uint32_t>(v * width + u));
      if (!seen) continue;
      picture.coverage.at(u, v) = on_object ? 1.0f : 0.0f;
      for (int c = 0; c < 3; ++c) (on_object ? picture.object : picture.change).at(u, v, c) = light[c];
    }
  }
  return picture;
}

}  // namespace lumigraft::comparators
