#pragma once
// Light on virtual surfaces. In: all volumes, object_normal, object_base, object_surface, rays.
// ambient: slowly varying light, which is the visibility of the lamps and all light except lamps (thesis eq.
// 5.23-5.24); out: object_irradiance, object_mirrored, object_open.
// shade: radiance (thesis eq. 5.23-5.25); in: that light, the lamp maps; out: object_radiance.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class ObjectShading {
 public:
  explicit ObjectShading(gpu::Device& device);
  void ambient(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;
  void shade(gpu::CommandList& list, shader::FrameParams params, const LampMaps& maps, const Volumes& volumes,
             const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> ambient_, shade_;
};

}  // namespace lumigraft::relight
