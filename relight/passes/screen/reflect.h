#pragma once
// Change of the specular part of real surfaces of known material (thesis eq. 5.22). In: all volumes, the real view,
// mirror_lost and mirror_all (Shadow), camera radiance. Out: mirror_gained, mirror_fraction, and both after smoothing.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Reflect {
 public:
  explicit Reflect(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> trace_, smooth_;
};

}  // namespace lumigraft::relight
