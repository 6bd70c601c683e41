#pragma once
// Converts flux and gathered light to radiance. In: listed_virtual, listed_real, virtual_flux, real_flux (Inject),
// gathered_virtual, real_irradiance (Bounce), real_albedo, real_radiance level 0 (RealFill), virtual_distance
// (VirtualFill). Out: level 0 of virtual_radiance and real_change, in the listed voxels only.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Resolve {
 public:
  explicit Resolve(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
