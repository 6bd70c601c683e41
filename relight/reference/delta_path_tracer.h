#pragma once
// The slow, obviously right renderer: light paths from the camera on, without a limit on bounces, and the change
// L_Δ = L_ρ - L_μ (Franke 2015, eq. 3.11) of radiance by virtual objects from paths of its own.
//
// At a real point that both worlds see, the change is what the change of arriving light makes of it. Towards a
// direction, that is
//   - a lamp or the sky, once seen, now behind an object: its light is lost;
//   - an object where another surface was: light scattered by the object, in the world with both, and antiradiance
//     A = -L_μ (eq. 3.14) that goes on behind it through real surfaces alone, as if it weren't there;
//   - the same real point in both worlds: its own change, by the same rule.
// So a path is one for both worlds until it first meets a virtual interface, and two from there on; and what never
// meets one costs no noise. Nothing is left out: the mean is L_ρ - L_μ. The first surfaces of a path also look for
// where light changes: towards the objects and their shadows. Lamps and environment pictures are sampled too; every
// direction is weighted by all the ways in which it may have been found (Veach & Guibas 1995).
#include <cstdint>
#include <memory>

#include "relight/tracing/posed_camera.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

struct ReferenceSamples {
  int per_pixel = 16;      ///< on average; `change` takes more of them where there is more noise
  std::uint32_t seed = 0;  ///< another seed, an independent picture
  int threads = 0;         ///< 0: as many as the machine has; never changes a picture
};

/// Means over the pixel's square. 3 channels, W/sr/m²; coverage 1 channel.
struct ReferencePicture {
  capture::Image<float> change;    ///< L_Δ of the share of the pixel that shows the real room, 0 for the rest
  capture::Image<float> object;    ///< L_ρ of the share that shows an object, 0 for the rest
  capture::Image<float> coverage;  ///< how large that share is
};

class DeltaPathTracer {
 public:
  explicit DeltaPathTracer(std::shared_ptr<const ReferenceScene> scene);
  ~DeltaPathTracer();

  ReferencePicture change(const PosedCamera& camera, const ReferenceSamples& samples) const;

  /// L_ρ (with the objects) or L_μ (without), by ordinary path tracing.
  capture::Image<float> radiance(const PosedCamera& camera, const ReferenceSamples& samples, bool with_objects) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
