#pragma once
// The enclosure around the reconstructed room, and the change of its light (see shaders/volume/volume.glsl).
// light: in: lamps, distances, real_radiance, the environment; out: enclosure_response, enclosure_lost.
// change: in: both, distances, virtual_radiance, real_change, the environment, enclosure_change of the previous round;
// out: enclosure_change.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class EnclosureLight {
 public:
  explicit EnclosureLight(gpu::Device& device);
  void light(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const;
  void change(gpu::CommandList& list, shader::FrameParams params, Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> light_, change_;
};

}  // namespace lumigraft::relight
