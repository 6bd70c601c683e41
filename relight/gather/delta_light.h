#pragma once
// Radiance along rays in both worlds. What a camera measured of the room and what the caches hold of the objects and of
// the change ends a ray where it meets them; only mirrors send it on.
//
// L_ρ, with the objects; L_μ, without; L_Δ = L_ρ - L_μ (Franke 2015, eq. 3.11).
#include <limits>
#include <optional>

#include "relight/gather/irradiance_change_cache.h"
#include "relight/gather/ray_objects.h"
#include "relight/gather/ray_room.h"
#include "relight/tracing/sampler.h"
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {

struct SampledRay {
  Eigen::Vector3f from_m, w;  ///< w unit
  /// 1/sr; lamps that it meets count by their share against samples of lamps (Veach & Guibas 1995); 0: not at all,
  /// where only those samples count.
  float pdf = 0;
};

class DeltaLight {
 public:
  /// Keeps references. `sphere`: around the objects.
  DeltaLight(const RayRoom& room, const RayObjects& objects, const IrradianceChangeCache& cells,
             const BoundingSphere& sphere)
      : room_(room), objects_(objects), cells_(cells), sphere_(sphere) {}

  /// W/sr/m². `mirrors`: how many more times a ray may be sent on.
  Rgb before(const SampledRay& ray, Sampler& sampler, int mirrors) const;                                // L_μ
  Rgb change(const SampledRay& ray, Sampler& sampler, int mirrors, float* to_object_m = nullptr) const;  // L_Δ
  Rgb with_objects(const SampledRay& ray, Sampler& sampler, int mirrors) const;                          // L_ρ
  /// The same, but where the ray ends on a matt object, only what comes from before it: `end` is the radiance that is
  /// to be added, which follows the irradiance of the objects.
  Rgb with_objects_unless(const SampledRay& ray, Sampler& sampler, int mirrors, const Rgb** end) const;

  /// What an object's mirror lobe sends back to where it is seen from, lamps among it. `mirrors` is at least 1.
  Rgb mirrored_by_object(const PathVertex& lobe, Sampler& sampler, int mirrors) const;
  /// What lamps bring to the vertex and objects do not hide; and what they hide of what came before.
  Rgb lit(const PathVertex& vertex, Sampler& sampler) const;
  Rgb hidden(const PathVertex& vertex, Sampler& sampler) const;
  /// By bit, which rays of a fan towards a lamp end on the room or on another lamp.
  std::uint32_t behind_room(const RayFan& fan, std::size_t lamp) const;
  /// Whether the objects may be between a point and a lamp.
  bool may_hide(std::size_t lamp, const Eigen::Vector3f& p_m) const;

  const RayObjects& objects() const { return objects_; }
  const RayRoom& room() const { return room_; }

 private:
  struct Arrival {
    enum class At { sky, real, object } at = At::sky;
    float t_m = 0;
    MeshHit hit;
  };
  /// What a ray meets first, in the room alone or nearer, on the objects.
  Arrival in_room(const SampledRay& ray) const;
  std::optional<Arrival> on_objects(const SampledRay& ray, float limit_m) const;
  /// What lamps send along the ray from between `near_m` and `far_m`.
  Rgb lamps_along(const SampledRay& ray, float near_m, float far_m) const;
  /// From beyond `near_m`.
  Rgb arriving_before(const SampledRay& ray, float near_m, const Arrival& at, Sampler& sampler, int mirrors) const;
  Rgb left_before(const SampledRay& ray, const Arrival& at, Sampler& sampler, int mirrors) const;
  Rgb left_change(const SampledRay& ray, const Arrival& at, Sampler& sampler, int mirrors) const;
  Rgb left_object(const SampledRay& ray, const Arrival& at, Sampler& sampler, int mirrors) const;
  /// Irradiance of lamps, for one point of each, that the objects hide from a point of the room.
  Rgb hidden_from(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal, Sampler& sampler) const;
  bool blocked_by_room(const Eigen::Vector3f& from_m, const Eigen::Vector3f& w, float limit_m, std::size_t lamp) const;
  template <typename Counts>
  Rgb lamps(const PathVertex& vertex, Sampler& sampler, Counts counts) const;
  std::optional<SampledRay> sent_on(const PathVertex& vertex, Sampler& sampler, Rgb* throughput) const;

  const RayRoom& room_;
  const RayObjects& objects_;
  const IrradianceChangeCache& cells_;
  BoundingSphere sphere_;  // around the objects
};

/// The same place, reflecting all of its light evenly: radiance that it sends back is irradiance over π.
SurfaceHit white_surface(SurfaceHit surface);
/// The Lambert part under its surface, seen from where the cosine is `cos_v`, per evenly arriving irradiance: times π.
Rgb diffuse_under(const BsdfParams& look, float cos_v);
/// The mirror part alone.
BsdfParams mirror_of(const BsdfParams& look);

}  // namespace lumigraft::relight
