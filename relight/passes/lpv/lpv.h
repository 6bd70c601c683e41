#pragma once
// Delta Light Propagation Volumes (thesis §5.3): the change of light is injected at the surfaces that cause it,
// propagated from cell to cell, and looked up at the receivers. Replaces Bounce::gather_real and Trace of cone tracing.
// Shadows of lamps (Shadow) and the light of the room on objects (ObjectShading) use cones in both methods.
#include "relight/passes/lpv/inject.h"
#include "relight/passes/lpv/propagate.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class Lpv {
 public:
  explicit Lpv(gpu::Device& device);
  void fit(gpu::Device& device, int edge_voxels, int steps);
  /// The change of irradiance on real surfaces by all light in the volumes, as Bounce::gather_real computes it. In
  /// rounds after the first only reflected light may have changed.
  void gather_real(gpu::CommandList& list, const shader::FrameParams& params, float brightest, int round, int rounds,
                   const Volumes& volumes);
  /// The same per pixel, from the light that gather_real left in the grid.
  void look_up(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;

 private:
  LpvInject inject_;
  LpvPropagate propagate_;
  std::unique_ptr<gpu::ComputePipeline> cells_, pixels_;  ///< look-ups: `beyond` and real_irradiance; indirect
  std::unique_ptr<LpvGrid> grid_;
  std::unique_ptr<gpu::Texture> beyond_;  ///< the enclosure's part of real_irradiance, of the same size
  int steps_ = 0;
};

}  // namespace lumigraft::relight
