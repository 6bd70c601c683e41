#pragma once
// The paths of one sample of a pixel. See delta_path_tracer.h for the estimator.
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {

struct PathRay {
  Eigen::Vector3f from_m, w;  ///< w unit
};

struct CameraSample {
  bool on_object = false;
  Rgb light = Rgb::Zero();  ///< L_ρ on an object, else L_Δ
};

class Paths {
 public:
  Paths(const TraceWorld& world, Sampler& sampler) : world_(world), sampler_(sampler) {}

  CameraSample change(const PathRay& ray);
  Rgb radiance(const PathRay& ray, bool with_objects) { return followed(ray, {}, with_objects); }

 private:
  /// How a path has come to where it is.
  struct Past {
    Rgb throughput = Rgb::Ones();
    float pdf = 0;  ///< of the last direction, 1/sr; 0: from the camera, which no lamp sample can know
    int bounces = 0;

    float chance_to_go_on() const;
  };
  /// What a ray meets first.
  struct Arrival {
    enum class At { sky, lamp, real, object } at = At::sky;
    float t_m = 0;
    std::size_t lamp = 0;
    MeshHit hit;
  };

  Arrival arrival(const PathRay& ray, bool with_objects) const;
  /// Light that reaches the ray's start along it from a lamp or the sky, weighted against sampling these.
  Rgb emitted(const PathRay& ray, const Arrival& arrival, float pdf) const;
  /// The same of lamps that hide nothing, on the way to where it arrives.
  Rgb on_the_way(const PathRay& ray, const Arrival& arrival, float pdf) const;
  Rgb followed(PathRay ray, Past past, bool with_objects);
  /// The change of what comes along a ray that meets `arrival` in the world with both.
  Rgb changed(const PathRay& ray, const Arrival& arrival, Past past);
  /// The same in a direction that the vertex has chosen, one way or the other.
  Rgb changed_towards(const PathVertex& vertex, const Eigen::Vector3f& w, Past past);
  /// What lamps and sky bring to the vertex at first hand, of those that `counts(w, limit, lamp)`.
  template <typename Counts>
  Rgb direct(const PathVertex& vertex, Counts counts);
  bool blocked_by_room(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m, std::size_t lamp) const;
  /// Russian roulette.
  bool lives(Past& past, float chance);

  const TraceWorld& world_;
  Sampler& sampler_;
};

}  // namespace lumigraft::relight
