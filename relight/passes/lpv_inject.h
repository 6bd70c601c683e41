#pragma once
// What propagation starts from. block: in: real_distance, virtual_distance; out: from_low, from_high.
// through: in: listed, real_distance, real_radiance, the environment; out: through. reflect: in: listed,
// virtual_radiance, real_change (level 0); out: reflected, source.
#include "relight/light_set.h"
#include "relight/passes/dispatch.h"
#include "relight/passes/lpv_grid.h"
#include "relight/passes/volumes.h"

namespace lumigraft {

class LpvInject {
 public:
  explicit LpvInject(gpu::Device& device);
  /// Chooses the fixed-point unit, for all that the lamps send to the objects and for light of the radiance
  /// `brightest` from everywhere.
  void choose_unit(const shader::FrameParams& params, float brightest);
  void block(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const LpvGrid& grid) const;
  void through(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
               const LpvGrid& grid) const;
  void reflect(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
               const LpvGrid& grid) const;

 private:
  shader::FrameParams with_units(shader::FrameParams params, const LpvGrid& grid) const;

  std::unique_ptr<gpu::ComputePipeline> block_, through_, inject_, source_;
  float unit_ = 1;  ///< of the sums, a watt
};

}  // namespace lumigraft
