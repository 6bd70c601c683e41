#pragma once
// Precomputed sample points of a source of light, shared by all receivers, in sets that are stratified over it; a
// receiver uses a set as a packet of shadow rays.
#include <array>
#include <vector>

#include "relight/tracing/lamps.h"
#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

/// Shadow rays towards one set, from one receiver.
struct ShadowRayPacket {
  RayFan rays;  ///< active rays: those with a non-zero weight
  /// Per ray, its irradiance over that of other rays; of a lamp, over its radiance, sr. 0 for inactive ones.
  std::array<float, RayFan::kMaxRays> weight;
  float all = 0;  ///< their sum: the unoccluded source

  /// Keeps only the first `rays`; they are stratified too if that is a power of two.
  void keep_first(int rays);
};

class LightSource {
 public:
  static constexpr int kSets = 16;

  virtual ~LightSource() = default;
  /// For a white surface. `set`: below kSets.
  virtual ShadowRayPacket from(const SurfaceHit& surface, int set) const = 0;
  /// Without occluders, W/m².
  virtual Rgb irradiance(const SurfaceHit& surface) const = 0;
  virtual const Eigen::Vector3f& centre_m() const = 0;
  virtual float reach_m() const = 0;  ///< radius of the bounding sphere around the centre
};

/// Of a lamp.
class LightSampleSet final : public LightSource {
 public:
  explicit LightSampleSet(const ReferenceLamp& lamp, std::uint32_t seed);

  ShadowRayPacket from(const SurfaceHit& surface, int set) const override;
  Rgb irradiance(const SurfaceHit& surface) const override { return lamp_.radiance * unhidden(surface); }
  const Eigen::Vector3f& centre_m() const override { return lamp_.centre_m; }
  float reach_m() const override { return lamp_reach_m(lamp_); }
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
