#pragma once
// The same points of a lamp for many places, in sets that are even over it: what a place takes of them as a fan of
// rays.
#include <array>
#include <vector>

#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

/// Towards one set, from one place.
struct ShadowRayPacket {
  RayFan rays;  ///< those from which anything could come
  /// By ray, the irradiance that it stands for over the lamp's radiance, sr; 0 for the others.
  std::array<float, RayFan::kMost> weight;
  float all = 0;  ///< their sum: of the lamp as if nothing were in its way

  /// The first `rays` alone in place of all; they are even too where that is a power of two.
  void keep_first(int rays);
};

class LightSampleSet {
 public:
  static constexpr int kSets = 16;

  explicit LightSampleSet(const ReferenceLamp& lamp, std::uint32_t seed);

  /// From a white surface. `set`: below kSets.
  ShadowRayPacket from(const SurfaceHit& surface, int set) const;
  /// What `all` of such a fan stands for, the same for each place: irradiance over the lamp's radiance, sr.
  float unhidden(const SurfaceHit& surface) const;

  const ReferenceLamp& lamp() const { return lamp_; }

 private:
  static constexpr int kAll = kSets;  // a set of its own
  using Row = std::array<float, RayFan::kMost>;
  struct Set {
    Row x, y, z;  ///< of a flat lamp: the point, tag frame; of a sphere: cosine and sine of the turn, share of the cap
  };
  ReferenceLamp lamp_;
  float area_m2_ = 0;  ///< of a flat lamp
  std::vector<Set> sets_;
};

}  // namespace lumigraft::relight
