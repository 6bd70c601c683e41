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
  VctDifference(const std::shared_ptr<gpu::Device>& device, const Session& session, std::shared_ptr<const Model> room);

  /// W/sr/m² of the whole picture, as the codes of the relighter's 8-bit picture tell it: a difference of two is good
  /// to one code. Volumes are kept where nothing has changed since the last call.
  Image<float> with(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit, const Plan& plan);
  Image<float> without(const FrameSet& frame, const Scene& scene, const Plan& plan);
  /// Moves the room by a micrometre to and fro, so that nothing of `without` is kept.
  void forget_without();

 private:
  Image<float> drawn(Relighter& relighter, const FrameSet& frame, const Scene& scene, const Exhibit& exhibit,
                     const Plan& plan) const;

  Session session_;
  std::shared_ptr<const DistanceField> nothing_;
  VirtualObject room_, moved_room_;
  Relighter with_, without_;
  bool moved_ = false;
};

}  // namespace lumigraft::comparators
