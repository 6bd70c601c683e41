#pragma once
// Delta Light Propagation Volumes (thesis §5.3): the change of light is injected at the surfaces that cause it,
// propagated from cell to cell, and looked up at the receivers. Replaces Bounce::gather_real and RealChange::trace of
// cone tracing. Shadows of lamps (RealChange) and the light of the room on objects (ObjectView) use cones in both
// methods.
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

/// Two cascades of cells, stacked along z, over the same cubes as those of Volumes (content: shaders/lpv/lpv_kernel.h).
struct LpvGrid {
  using Light = std::array<std::unique_ptr<gpu::Texture>, 3>;  ///< red, green, blue: Φ and J, W per cell

  int edge = 0;                                       ///< cells along the edge of a cascade
  std::unique_ptr<gpu::Texture> from_low, from_high;  ///< fraction of the neighbours' light that enters; open volume
  std::unique_ptr<gpu::Buffer> of_virtual, of_real;   ///< sources at virtual and at real surfaces, fixed point
  Light source, light;

  LpvGrid(gpu::Device& device, int edge_cells);
};

class Lpv {
 public:
  explicit Lpv(gpu::Device& device);
  /// Cells of 2³ voxels, at most 64 along the edge of a cascade. `steps`: of propagation.
  void fit(gpu::Device& device, int edge_voxels, int steps);
  /// The change of irradiance on real surfaces by all light in the volumes, as Bounce::gather_real computes it. In
  /// rounds after the first only reflected light may have changed.
  void gather_real(gpu::CommandList& list, const shader::FrameParams& params, float brightest, int round, int rounds,
                   const Volumes& volumes);
  /// The same per pixel, from the light that gather_real left in the grid.
  void look_up(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes, const Screen& screen) const;

  /// From `source`, from_low and from_high to `light` (thesis §5.3.1): sweeps over all cells, of two steps each; starts
  /// from zero, or from the content of `light` if `go_on`.
  void propagate(gpu::CommandList& list, shader::FrameParams params, int sweeps, bool go_on) const;
  const LpvGrid& grid() const { return *grid_; }

 private:
  /// Chooses the fixed-point unit so that neither the lamps' light on the objects nor light of radiance `brightest`
  /// from all directions overflows.
  void choose_unit(const shader::FrameParams& params, float brightest);
  shader::FrameParams with_units(shader::FrameParams params) const;
  /// From real_distance and virtual_distance to from_low and from_high.
  void block(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const;
  /// From listed_virtual, virtual_radiance (level 0), gathered_virtual, virtual_area, real_distance, real_radiance and
  /// the environment to of_virtual. `add_gathered`: virtual_radiance does not include gathered_virtual yet.
  void at_virtual(gpu::CommandList& list, const shader::FrameParams& params, bool add_gathered,
                  const Volumes& volumes) const;
  /// From listed_real, real_change (level 0) and real_normal to of_real.
  void at_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const;
  /// From of_virtual and of_real to source.
  void sum(gpu::CommandList& list, const shader::FrameParams& params) const;

  std::unique_ptr<gpu::ComputePipeline> block_, virtual_, real_, sum_, step_;
  std::unique_ptr<gpu::ComputePipeline> cells_, pixels_;  ///< look-ups: `beyond` and real_irradiance; indirect
  std::unique_ptr<LpvGrid> grid_;
  std::unique_ptr<gpu::Texture> beyond_;  ///< the enclosure's part of real_irradiance, of the same size
  int steps_ = 0;
  float unit_ = 1;  ///< fixed-point unit of the sums, W
};

}  // namespace lumigraft::relight
