#pragma once
// Differential rendering (Debevec 1998) by voxel cone tracing (Crassin et al. 2011): two complete solutions, of the
// scene with and without objects, and their difference.
//
// The relighter renders both, with the room as another virtual object in an empty world: same shaders, cones, bounces
// and voxels as dvct with the same plan. Its volumes enclose all virtual geometry, so here the whole room, where dvct's
// finer volume encloses the objects only.
#include <memory>

#include "capture/session/session.h"
#include "relight/gpu/device.h"
#include "relight/relighter.h"

namespace lumigraft::comparators {

class VctDifference {
 public:
  VctDifference(const std::shared_ptr<relight::gpu::Device>& device, const capture::Session& session,
                std::shared_ptr<const relight::Model> room);

  /// Radiance of the whole picture, W/sr/m², decoded from the relighter's 8-bit picture: a difference has a resolution
  /// of one pixel value. Volumes are reused where nothing changed since the last call.
  capture::Image<float> with(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                             const relight::Exhibit& exhibit, const relight::Plan& plan);
  capture::Image<float> without(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                const relight::Plan& plan);
  /// Moves the room back and forth by a micrometre, to discard the cache of `without`.
  void forget_without();

 private:
  capture::Image<float> drawn(relight::Relighter& relighter, const capture::FrameSet& frame,
                              const reconstruct::Scene& scene, const relight::Exhibit& exhibit,
                              const relight::Plan& plan) const;

  capture::Session session_;
  std::shared_ptr<const reconstruct::DistanceField> nothing_;
  relight::VirtualObject room_, moved_room_;
  relight::Relighter with_, without_;
  bool moved_ = false;
};

}  // namespace lumigraft::comparators
