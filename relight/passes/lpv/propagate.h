#pragma once
// Propagation (thesis §5.3.1). In: source, from_low, from_high. Out: light.
#include "relight/passes/dispatch.h"
#include "relight/passes/lpv/grid.h"

namespace lumigraft::relight {

class LpvPropagate {
 public:
  explicit LpvPropagate(gpu::Device& device) : step_(device.create_compute("lpv_step.comp")) {}
  /// Sweeps over all cells, of two steps each; starts from zero, or from the content of `light` if `go_on`.
  void record(gpu::CommandList& list, shader::FrameParams params, int sweeps, bool go_on, const LpvGrid& grid) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> step_;
};

}  // namespace lumigraft::relight
