#pragma once
// Delta Light Propagation Volumes (thesis §5.3): the change of light starts at the surfaces where it arises, moves from
// cell to cell, and is looked up where it arrives. Beside cone tracing it takes the place of Bounce::gather_real and of
// Trace. Shadows of lamps are drawn by cones (Shadow), and objects see the room by cones (Ambient), for both methods.
#include "relight/passes/lpv/inject.h"
#include "relight/passes/lpv/propagate.h"
#include "relight/passes/lpv/query.h"

namespace lumigraft::relight {

class Lpv {
 public:
  explicit Lpv(gpu::Device& device);
  void fit(gpu::Device& device, int edge_voxels, int steps);
  /// The change of irradiance on real surfaces by all light in the volumes, as Bounce::gather_real finds it. In the
  /// rounds after the first nothing but the reflected light may have changed.
  void gather_real(gpu::CommandList& list, const shader::FrameParams& params, float brightest, int round, int rounds,
                   const Volumes& volumes);
  /// The same in every pixel, from the light that gather_real left.
  void look_up(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
               const Screen& screen) const;

 private:
  LpvInject inject_;
  LpvPropagate propagate_;
  LpvQuery query_;
  std::unique_ptr<LpvGrid> grid_;
  std::unique_ptr<gpu::Texture> beyond_;  ///< the enclosure's part of real_irradiance, as large
  int steps_ = 0;
};

}  // namespace lumigraft::relight
