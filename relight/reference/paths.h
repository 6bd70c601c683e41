#pragma once
// The paths of one sample of a pixel. The estimator is described in delta_path_tracer.h.
#include "relight/tracing/photon_map.h"
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
  /// `photons`: light of lamps by transmissive objects, which paths leave out; null: paths alone find it.
  Paths(const TraceWorld& world, Sampler& sampler, const PhotonMap* photons = nullptr)
      : world_(world), sampler_(sampler), photons_(photons) {}

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
    Rgb absorption = Rgb::Zero();  ///< of the medium that the path is in, 1/m
    /// The last vertex that is not an interface of a transmissive object received photons; there was such an interface
    /// since.
    bool from_receiver = false, by_interface = false;
    /// From the camera, by nothing but interfaces so far: unlit objects show their colour.
    bool of_camera = true;

    float chance_to_go_on() const;
    /// Whether photons bring the light of lamps that the path meets.
    bool photons_bring_lamps() const { return from_receiver && by_interface; }
  };
  /// A surface, or the lobe of it that was chosen.
  struct Vertex {
    PathVertex path;
    bool receives = false;  ///< photons
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
  /// With photons or unlit objects, a surface with interface and body is one of both, as only the body receives photons
  /// and only the interface mirrors the colour of unlit objects.
  Vertex vertex_of(SurfaceHit surface, const Eigen::Vector3f& w, bool of_object, Past& past);
  Rgb photons_at(const Vertex& vertex, const SurfaceHit& surface) const;
  /// Changes the path to one that leaves the vertex along w.
  PathRay left(const PathVertex& vertex, const Eigen::Vector3f& w, float pdf, Past& past) const;
  Rgb followed(PathRay ray, Past past, bool with_objects);
  /// The change of radiance along a ray whose hit is `arrival` in the scene with objects.
  Rgb changed(const PathRay& ray, const Arrival& arrival, Past past);
  /// The same for a direction that the vertex sampled, by any strategy.
  Rgb changed_towards(const PathVertex& vertex, const Eigen::Vector3f& w, Past past);
  /// Direct light of the sky, and of lamps if `of_lamps`, at the vertex, of samples for which `counts(w, limit, lamp)`.
  template <typename Counts>
  Rgb direct(const PathVertex& vertex, bool of_lamps, Counts counts);
  bool blocked_by_room(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m, std::size_t lamp) const;
  /// Russian roulette.
  bool lives(Past& past, float chance);

  const TraceWorld& world_;
  Sampler& sampler_;
  const PhotonMap* photons_;
};

}  // namespace lumigraft::relight
