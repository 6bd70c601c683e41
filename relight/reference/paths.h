#pragma once
// The paths of one sample of a pixel. The estimator is described in delta_path_tracer.h.
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {

struct PathRay {
  Eigen::Vector3f from_m, w;  ///< w unit
};

struct CameraSample {
  bool on_object = false;
  Rgb light = Rgb::Zero();  ///< L_ρ on an object, else L_Δ
  float object_m = 0;       ///< along the ray to the object
};

class Paths {
 public:
  Paths(const TraceWorld& world, Sampler& sampler) : world_(world), sampler_(sampler) {}

  CameraSample change(const PathRay& ray);
  /// The object along a ray that ends on the room, as if the room did not hide it.
  std::optional<CameraSample> hidden_object(const PathRay& ray);
  Rgb radiance(const PathRay& ray, bool with_objects) { return followed(ray, {}, with_objects); }

 private:
  /// State of the path so far.
  struct Past {
    Rgb throughput = Rgb::Ones();
    float pdf = 0;  ///< of the last direction, 1/sr; 0: from the camera, without lamp sampling
    int bounces = 0;

    float chance_to_go_on() const;
  };
  /// The first hit of a ray.
  struct Arrival {
    enum class At { sky, lamp, real, object } at = At::sky;
    float t_m = 0;
    std::size_t lamp = 0;
    MeshHit hit;
  };

  Arrival arrival(const PathRay& ray, bool with_objects) const;
  /// Light emitted by a lamp or the sky towards the ray's origin, MIS-weighted against their sampling.
  Rgb emitted(const PathRay& ray, const Arrival& arrival, float pdf) const;
  /// The same for non-occluding lamps along the ray, up to its hit.
  Rgb on_the_way(const PathRay& ray, const Arrival& arrival, float pdf) const;
  /// Radiance that an object emits along a ray, MIS-weighted against the sampling of emitters; pdf 0: all of it.
  Rgb emitted_by_object(const MeshHit& hit, const SurfaceHit& surface, const Eigen::Vector3f& w, float pdf) const;
  /// Direct light of objects that emit, at the vertex.
  Rgb lit_by_objects(const PathVertex& vertex);
  Rgb followed(PathRay ray, Past past, bool with_objects);
  /// The change of radiance along a ray whose hit is `arrival` in the scene with objects.
  Rgb changed(const PathRay& ray, const Arrival& arrival, Past past);
  /// The same for a direction that the vertex sampled, by any strategy.
  Rgb changed_towards(const PathVertex& vertex, const Eigen::Vector3f& w, Past past);
  /// Direct light of lamps and sky at the vertex, of those samples for which `counts(w, limit, lamp)`.
  template <typename Counts>
  Rgb direct(const PathVertex& vertex, Counts counts);
  bool blocked_by_room(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m, std::size_t lamp) const;
  /// Russian roulette.
  bool lives(Past& past, float chance);

  const TraceWorld& world_;
  Sampler& sampler_;
};

}  // namespace lumigraft::relight
