#pragma once
// What compose/composer.h blends to the final frame. In: camera radiance, the real view, all changes, object_radiance,
// object_surface. Out: delta, room_radiance, object_layer, object_z.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class Layers {
 public:
  explicit Layers(gpu::Device& device) : pipeline_(device.create_compute("layers.comp")) {}
  void record(gpu::CommandList& list, const shader::FrameParams& params, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
