#pragma once
// Indirect change of real surfaces (thesis eq. 5.21) at 1/scale. In: all volumes, real_position, real_normal,
// object_surface. Out: traced.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Trace {
 public:
  explicit Trace(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, int change_cones, const Volumes& volumes,
              const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
