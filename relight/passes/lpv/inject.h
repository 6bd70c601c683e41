#pragma once
// Sources of the propagation.
// block: in: real_distance, virtual_distance; out: from_low, from_high.
// at_virtual: in: listed_virtual, virtual_radiance (level 0), gathered_virtual, virtual_area, real_distance,
// real_radiance, the environment; out: of_virtual.
// at_real: in: listed_real, real_change (level 0), real_normal; out: of_real.
// sum: of_virtual, of_real to source.
#include "relight/passes/dispatch.h"
#include "relight/passes/lpv/grid.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class LpvInject {
 public:
  explicit LpvInject(gpu::Device& device);
  /// Chooses the fixed-point unit so that neither the lamps' light on the objects nor light of radiance `brightest`
  /// from all directions overflows.
  void choose_unit(const shader::FrameParams& params, float brightest);
  void block(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const LpvGrid& grid) const;
  /// `add_gathered`: virtual_radiance does not include gathered_virtual yet.
  void at_virtual(gpu::CommandList& list, const shader::FrameParams& params, bool add_gathered, const Volumes& volumes,
                  const LpvGrid& grid) const;
  void at_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
               const LpvGrid& grid) const;
  void sum(gpu::CommandList& list, const shader::FrameParams& params, const LpvGrid& grid) const;

 private:
  shader::FrameParams with_units(shader::FrameParams params, const LpvGrid& grid) const;

  std::unique_ptr<gpu::ComputePipeline> block_, virtual_, real_, sum_;
  float unit_ = 1;  ///< fixed-point unit of the sums, W
};

}  // namespace lumigraft::relight
