#pragma once
// Direct change of real surfaces (thesis eq. 5.20). In: the distance volumes, real_position, real_normal, real_albedo,
// object_surface. Out: direct_lost, mirror_lost, mirror_all.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Shadow {
 public:
  explicit Shadow(gpu::Device& device);
  /// `glossy`: materials of real surfaces are known; shadows are then computed at full size. `by_mirrors`: include the
  /// light of lamps reflected by mirrors that the objects block.
  void record(gpu::CommandList& list, shader::FrameParams params, bool glossy, bool by_mirrors, const LampMaps& maps,
              const Volumes& volumes, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> matt_, glossy_;
};

}  // namespace lumigraft::relight
