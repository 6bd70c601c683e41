#pragma once
// Precomputed sample points of a lamp, shared by all receivers, in sets that are stratified over it; a receiver uses a
// set as a packet of shadow rays.
#include <array>
#include <vector>

#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

/// Shadow rays towards one set, from one receiver.
struct ShadowRayPacket {
  RayFan rays;  ///< active rays: those with a non-zero weight
  /// Per ray, its irradiance over the lamp's radiance, sr; 0 for inactive ones.
  std::array<float, RayFan::kMaxRays> weight;
  float all = 0;  ///< their sum: the unoccluded lamp

  /// Keeps only the first `rays`; they are stratified too if that is a power of two.
  void keep_first(int rays);
};

class LightSampleSet {
 public:
  static constexpr int kSets = 16;

  explicit LightSampleSet(const ReferenceLamp& lamp, std::uint32_t seed);

  /// For a white surface. `set`: below kSets.
  ShadowRayPacket from(const SurfaceHit& surface, int set) const;
  /// The value of `all` of such a packet, independent of the set: irradiance over the lamp's radiance, sr.
  float unhidden(const SurfaceHit& surface) const;

  const ReferenceLamp& lamp() const { return lamp_; }

 private:
  static constexpr int kAll = kSets;  // index of the set of all points
  using Row = std::array<float, RayFan::kMaxRays>;
  struct Set {
    Row x, y, z;  ///< flat: the point, tag frame; sphere: cosine and sine of the azimuth, share of the cap
  };
  ReferenceLamp lamp_;
  float area_m2_ = 0;  ///< of a flat lamp
  std::vector<Set> sets_;
};

/// On a white surface without occluders: of the lamps and the rest of the environment, W/m².
Rgb unoccluded_irradiance(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                          const SurfaceHit& surface);

}  // namespace lumigraft::relight
