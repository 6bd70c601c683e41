#pragma once
// Radiance of virtual surfaces (thesis eq. 5.23-5.25). In: all volumes, object_normal, object_base, object_surface,
// object_irradiance, object_mirrored, object_open, rays. Out: object_radiance.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Shade {
 public:
  explicit Shade(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const LampMaps& maps, const Volumes& volumes,
              const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
