#pragma once
// Radiance along rays with and without the objects. Rays end at the first surface, in the radiance that cameras
// measured of the room or in the cached light of objects and cells; only specular and transmissive surfaces continue
// them. Light of lamps that reaches matt surfaces by transmissive objects and smooth metals is a density of photons
// (tracing/photon_tracing.h).
// L_ρ: with the objects; L_μ: without; L_Δ = L_ρ - L_μ (Franke 2015, eq. 3.11).
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruct/light/lamp_shadows.h"
#include "relight/gather/irradiance_change_cache.h"
#include "relight/gather/light_change.h"
#include "relight/gather/moved_occluders.h"
#include "relight/gather/ray_objects.h"
#include "relight/gather/ray_room.h"
#include "relight/gather/seen_radiance.h"
#include "relight/tracing/photon_map.h"
#include "relight/tracing/sampler.h"
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {

struct SampledRay {
  Eigen::Vector3f from_m, w;  ///< w unit
  /// 1/sr; lamps on the ray are weighted by multiple importance sampling against lamp samples (Veach & Guibas 1995); 0:
  /// lamps are excluded, as only lamp samples count.
  float pdf = 0;
  /// That the ray represents in a sum of irradiance; an object that it hits is rougher by it (Meshes::surface_within).
  float solid_angle_sr = 0;
  /// To the normal of a matt surface that gathers light over its hemisphere: what an object on the ray emits is
  /// weighted against sample points of it (EmitterSampleSet). 0: as lamps.
  float cosine = 0;
  /// From a matt surface by interfaces that photons leave, too: lamps are excluded, as photons bring their light, and
  /// what an object emits counts, as its sample points are hidden.
  bool by_interface = false;
  bool of_camera = false;              ///< by nothing but mirrors and interfaces: unlit objects show their colour
  int interfaces = 0;                  ///< of such objects on the path so far
  Rgb absorption = Rgb::Zero();        ///< of the medium that the ray is in, 1/m
  const SeenRadiance* seen = nullptr;  ///< where the camera shows the room at the ray's end; null: as it was fused
};

class DeltaLight {
 public:
  /// Keeps references. `sphere`: around the objects.
  DeltaLight(const RayRoom& room, const RayObjects& objects, const IrradianceChangeCache& cells,
             const BoundingSphere& sphere)
      : room_(room), objects_(objects), cells_(cells), sphere_(sphere) {}

  /// W/sr/m². `mirrors`: maximum number of further specular reflections.
  Rgb before(const SampledRay& ray, Sampler& sampler, int mirrors) const;                                // L_μ
  Rgb change(const SampledRay& ray, Sampler& sampler, int mirrors, float* to_object_m = nullptr) const;  // L_Δ
  Rgb with_objects(const SampledRay& ray, Sampler& sampler, int mirrors) const;                          // L_ρ
  /// The same, but if the ray ends on a matt object, returns only the light from in front of it: `end` is the radiance
  /// to be added, which follows the objects' irradiance.
  Rgb with_objects_unless(const SampledRay& ray, Sampler& sampler, int mirrors, const Rgb** end) const;

  /// Radiance that leaves a transmissive object's surface by its interface, or by one of its lobes, towards the origin
  /// of the ray, with that of lamps unless the ray excludes them.
  Rgb by_interface(const SampledRay& ray, SurfaceHit surface, Lobes lobes, Sampler& sampler, int mirrors) const;
  /// Irradiance of a matt surface by lamps through transmissive objects, and reflected by them and by smooth metals.
  Rgb caustic(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const {
    return photons_ ? photons_->irradiance(p_m, normal) : Rgb::Zero();
  }
  /// Fraction of a lamp's light that the room lets pass to a point; w: unit, to a point of the lamp at this distance.
  float open_from(std::size_t lamp, const Eigen::Vector3f& p_m, const Eigen::Vector3f& w, float distance_m) const;

  /// Radiance that an object's specular lobe reflects to the viewer, including lamps. `mirrors` is at least 1;
  /// `of_camera`: as in SampledRay, of the ray that sees it.
  Rgb mirrored_by_object(const PathVertex& lobe, Sampler& sampler, int mirrors, bool of_camera) const;
  /// lit: light of lamps at the vertex that objects do not occlude. change_of_lamps: less the light from before that
  /// they occlude. If the vertex is specular both include objects that emit.
  Rgb lit(const PathVertex& vertex, Sampler& sampler) const;
  Rgb change_of_lamps(const PathVertex& vertex, Sampler& sampler) const;
  /// Irradiance of a matt surface by sample points of the objects that emit. `set`: LightSource::from.
  Rgb lit_by_points(const SurfaceHit& surface, int set) const;
  /// Bit mask of the rays of a fan towards a lamp that the room or another lamp blocks. `lamp`: kNoLamp for an object.
  std::uint32_t behind_room(const RayFan& fan, std::size_t lamp) const;
  static constexpr std::size_t kNoLamp = std::numeric_limits<std::size_t>::max();
  /// Whether the objects may be between a point and a lamp.
  bool may_hide(std::size_t lamp, const Eigen::Vector3f& p_m) const;

  /// What moved in the room since it was fused, as shadow rays see it, and the light of now on the room; null: nothing
  /// did, the light is the same.
  void set_moved(std::shared_ptr<const MovedOccluders> moved, std::shared_ptr<const LightChange> light) {
    moved_ = std::move(moved);
    light_change_ = std::move(light);
  }
  /// Shadows that the colour frame shows; null: none.
  void set_shadows(std::shared_ptr<const reconstruct::LampShadows> shadows);
  /// None is set without objects that they reach.
  void set_photons(std::shared_ptr<const PhotonMap> photons);
  /// At most this fraction of a lamp's light reaches a point, as the shadows show.
  float open(std::size_t lamp, const Eigen::Vector3f& p_m) const {
    return lamp >= of_lamps_.size() || !of_lamps_[lamp] ? 1 : of_lamps_[lamp]->open_at(p_m);
  }

  const LightChange* light_change() const { return light_change_.get(); }  ///< null: none
  const RayObjects& objects() const { return objects_; }
  const RayRoom& room() const { return room_; }

 private:
  /// First hit in the room only (none: the sky), or a nearer one on the objects.
  std::optional<MeshHit> in_room(const SampledRay& ray) const;
  std::optional<MeshHit> on_objects(const SampledRay& ray, const std::optional<MeshHit>& room) const;
  /// Radiance of lamps along the ray between `near_m` and `far_m`.
  Rgb lamps_along(const SampledRay& ray, float near_m, float far_m) const;
  /// From beyond `near_m`.
  Rgb arriving_before(const SampledRay& ray, float near_m, const std::optional<MeshHit>& room, Sampler& sampler,
                      int mirrors) const;
  Rgb left_before(const SampledRay& ray, const MeshHit& hit, Sampler& sampler, int mirrors) const;
  /// Change of the irradiance of a facet without the light of lamps that objects occlude.
  Rgb change_in_cell(const SampledRay& ray, const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const;
  Rgb left_change(const SampledRay& ray, const MeshHit& hit, Sampler& sampler, int mirrors) const;
  /// As RayObjects::even_radiance; null where the ray sees an unlit object in its colour.
  const Rgb* even_radiance(const SampledRay& ray, const MeshHit& hit) const;
  Rgb left_object(const SampledRay& ray, const MeshHit& hit, Sampler& sampler, int mirrors) const;
  /// Irradiance of lamps, from one sample per lamp, that the objects occlude at a point of the room.
  Rgb hidden_from(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal, Sampler& sampler) const;
  /// What an object that the ray hits emits, weighted as lamps are.
  Rgb emitted(const SampledRay& ray, const MeshHit& hit) const;
  /// Direct light of objects that emit, at a specular vertex.
  Rgb lit_by_objects(const PathVertex& vertex, Sampler& sampler) const;
  bool blocked_by_room(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m, std::size_t lamp) const;
  template <typename Counts>
  Rgb lamps(const PathVertex& vertex, Sampler& sampler, Counts counts) const;
  /// with_objects, less what the ray's medium absorbs.
  Rgb within_medium(const SampledRay& ray, Sampler& sampler, int mirrors) const;
  std::optional<SampledRay> sent_on(const PathVertex& vertex, Sampler& sampler, Rgb* throughput) const;

  const RayRoom& room_;
  const RayObjects& objects_;
  const IrradianceChangeCache& cells_;
  BoundingSphere sphere_;  // around the objects
  std::shared_ptr<const MovedOccluders> moved_;
  std::shared_ptr<const LightChange> light_change_;
  std::shared_ptr<const PhotonMap> photons_;
  std::vector<Rgb> caustic_of_cells_;  ///< by cell of `cells_`, for rays of later bounces; empty: none
  std::shared_ptr<const reconstruct::LampShadows> shadows_;
  std::vector<const reconstruct::LampShadow*> of_lamps_;  ///< of `shadows_`, by lamp of the room; empty: none
};

/// The same point with a white Lambert material: its reflected radiance is irradiance over π.
SurfaceHit white_surface(SurfaceHit surface);
/// The Lambert part below the interface, viewed along w: π times radiance per uniform incident irradiance.
Rgb diffuse_under(const SurfaceHit& surface, const Eigen::Vector3f& w);
/// The same point with the specular part only.
SurfaceHit mirror_of(SurfaceHit surface);

}  // namespace lumigraft::relight
