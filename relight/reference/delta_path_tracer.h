#pragma once
// Reference path tracer: unbounded light paths from the camera, and the change L_Δ = L_ρ - L_μ (Franke 2015, eq. 3.11)
// of radiance by virtual objects, estimated directly.
//
// At a real point visible in both scenes, the change of outgoing light is the reflected change of incident light. For
// an incident direction that is
// - a lamp or the sky, now occluded by an object: its light is lost;
// - an object in front of another surface: light scattered by the object, in the scene with both, and antiradiance A =
//   -L_μ (eq. 3.14), which continues behind it through real surfaces only, as if the object did not exist;
// - the same real point in both scenes: its own change, by the same rule.
//
// A path is thus shared by both scenes until it first hits a virtual surface, and splits in two from there on; paths
// that hit none add no noise. The estimator is unbiased: its mean is L_ρ - L_μ. The first vertices of a path also
// sample directions towards the objects and their shadows. Lamps and environment maps are sampled too; all sampling
// strategies are combined by multiple importance sampling (Veach & Guibas 1995).
//
// Light of lamps that reaches matt surfaces by the interfaces of transmissive objects alone, caustics and coloured
// shadows, is a density of photons (tracing/photon_tracing.h): paths would find small lamps through glass by chance.
// Its mean over a surface is unbiased, its detail as coarse as the distance between photons. `radiance` has paths
// alone.
#include <cstdint>
#include <memory>

#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

struct TraceWorld;
class PhotonMap;

struct ReferenceSamples {
  int per_pixel = 16;      ///< on average; `change` uses more where noise is higher
  std::uint32_t seed = 0;  ///< a different seed gives an independent image
  bool unhidden = false;   ///< also gives objects as if no real surface were in front of them
};

/// Means over the pixel's square. 3 channels, W/sr/m²; coverage and distance 1 channel.
struct ReferencePicture {
  capture::Image<float> change;    ///< L_Δ of the part of the pixel that shows the real room, 0 for the rest
  capture::Image<float> object;    ///< L_ρ of the part that shows an object, 0 for the rest
  capture::Image<float> coverage;  ///< fraction of that part
  /// With ReferenceSamples::unhidden: the last two as if no real surface were in front, and the distance along the ray
  /// to those objects, 0: none.
  capture::Image<float> unhidden_object = {}, unhidden_coverage = {}, distance_m = {};
};

class DeltaPathTracer {
 public:
  explicit DeltaPathTracer(std::shared_ptr<const ReferenceScene> scene);
  ~DeltaPathTracer();

  ReferencePicture change(const PosedCamera& camera, const ReferenceSamples& samples) const;

  /// L_ρ (with the objects) or L_μ (without), by ordinary path tracing: the slow reference of photons, too.
  capture::Image<float> radiance(const PosedCamera& camera, const ReferenceSamples& samples, bool with_objects) const;

 private:
  std::unique_ptr<const TraceWorld> world_;
  std::unique_ptr<const PhotonMap> photons_;  ///< null: no transmissive object, or no lamp
};

}  // namespace lumigraft::relight
