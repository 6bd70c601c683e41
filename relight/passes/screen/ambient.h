#pragma once
// Slowly varying light on virtual surfaces: visibility of the lamps, and all light except lamps (thesis eq. 5.23-5.24).
// In: all volumes, object_normal, object_base, object_surface, rays. Out: object_irradiance, object_mirrored,
// object_open.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Ambient {
 public:
  explicit Ambient(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
