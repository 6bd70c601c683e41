#pragma once
// The final frame (thesis §5.4.4). In: camera codes and radiance, the real view, all changes, object_radiance,
// object_surface. Out: picture, delta.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class Compose {
 public:
  explicit Compose(gpu::Device& device) : pipeline_(device.create_compute("compose.comp")) {}
  void record(gpu::CommandList& list, const shader::FrameParams& params, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
