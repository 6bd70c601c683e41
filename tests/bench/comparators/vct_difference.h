#pragma once
// Differential rendering (Debevec 1998) by voxel cone tracing (Crassin et al. 2011): the whole scene twice, with the
// objects and without, each a complete solution; then the one less the other.
//
// Both are drawn by the relighter itself, to which the room is one virtual object more in an empty world: the same
// shaders, cones, bounces and voxels as dvct has with the same plan. Its volumes follow from what is virtual, so they
// hold the whole of the room that is given, where dvct's finer one holds the objects alone.
#include <memory>

#include "capture/session/session.h"
#include "relight/gpu/device.h"
#include "relight/relighter.h"

namespace lumigraft::comparators {

class VctDifference {
 public:
  VctDifference(const std::shared_ptr<relight::gpu::Device>& device, const capture::Session& session,
                std::shared_ptr<const relight::Model> room);

  /// W/sr/m² of the whole picture, as the codes of the relighter's 8-bit picture tell it: a difference of two is good
  /// to one code. Volumes are kept where nothing has changed since the last call.
  capture::Image<float> with(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                             const relight::Exhibit& exhibit, const relight::Plan& plan);
  capture::Image<float> without(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                const relight::Plan& plan);
  /// Moves the room by a micrometre to and fro, so that nothing of `without` is kept.
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
