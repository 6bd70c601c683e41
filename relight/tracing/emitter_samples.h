#pragma once
// Light of objects that emit, at matt surfaces: the sum over patches, of which rays to sample points find the visible
// fraction, combined by multiple importance sampling (Veach & Guibas 1995) with rays that the surfaces send over their
// hemisphere. Far from an object the patches decide, next to it the rays.
#include <span>
#include <vector>

#include "relight/tracing/emitters.h"
#include "relight/tracing/light_samples.h"

namespace lumigraft::relight {

class EmitterSampleSet final : public LightSource {
 public:
  /// Of a mesh that emits.
  EmitterSampleSet(const Emitters& emitters, std::size_t mesh, std::uint32_t seed);

  /// What a ray over the hemisphere that hits an object counts of its emission. `cosine`: to the surface's normal;
  /// `point_pdf`: Emitters::point_pdf.
  static float fraction_of_ray(float cosine, float point_pdf);

  /// The part that the points count, as in `irradiance`.
  ShadowRayPacket from(const SurfaceHit& surface, int set) const override;
  Rgb irradiance(const SurfaceHit& surface) const override;
  const Eigen::Vector3f& centre_m() const override { return centre_m_; }
  float reach_m() const override { return reach_m_; }

 private:
  /// Calls `add(k, point, vector to it, distance, irradiance over radiance)` for those that face a surface.
  template <typename Add>
  static void for_each(const SurfaceHit& surface, std::span<const EmitterPoint> points, Add add);

  std::vector<EmitterPoint> points_;                    ///< set by set
  std::vector<EmitterPoint> patches_, merged_patches_;  ///< for surfaces near by, and for others
  Eigen::Vector3f centre_m_;
  float reach_m_ = 0;
};

/// One per mesh that emits.
std::vector<EmitterSampleSet> emitter_samples_of(const Emitters& emitters);

}  // namespace lumigraft::relight
