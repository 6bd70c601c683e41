#include "relight/passes/lpv/inject.h"

#include <algorithm>
#include <numbers>

#include "relight/passes/volume/virtual_fill.h"

namespace lumigraft::relight {

LpvInject::LpvInject(gpu::Device& device)
    : block_(device.create_compute("lpv_blocking.comp")),
      virtual_(device.create_compute("lpv_virtual.comp")),
      real_(device.create_compute("lpv_real.comp")),
      sum_(device.create_compute("lpv_source.comp")) {}

void LpvInject::choose_unit(const shader::FrameParams& params, float brightest) {
  // The lamps' part is that of the flux volumes (Inject::choose_unit). The objects' surface is assumed to be at most
  // that of their bounding sphere: as much light passes through it, and as much again is reflected.
  const double pi = std::numbers::pi, radius_m = params.sphere.w();
  const double lamps_W = 1e9 * static_cast<double>(params.field.w());
  const double even_W = 2 * 4 * pi * radius_m * radius_m * pi * brightest;
  unit_ = static_cast<float>(5e8 / (lamps_W + even_W));
}

shader::FrameParams LpvInject::with_units(shader::FrameParams params, const LpvGrid& grid) const {
  params.pass_i.x() = grid.edge;
  params.pass_f << unit_, 1 / unit_, 1.0f / VirtualFill::kUnitsPerFace, 0;
  return params;
}

void LpvInject::block(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                      const LpvGrid& grid) const {
  params.pass_i.x() = grid.edge;
  dispatch_cascades(list, *block_,
                    joined(volumes.bindings(), {gpu::image(12, *grid.from_low), gpu::image(13, *grid.from_high)}),
                    params, grid.edge);
}

void LpvInject::at_virtual(gpu::CommandList& list, const shader::FrameParams& params, bool add_gathered,
                           const Volumes& volumes, const LpvGrid& grid) const {
  shader::FrameParams own = with_units(params, grid);
  own.pass_i.y() = std::max(params.counts.z() / 2, 3);  // each voxel rotates them; a cell holds the mean of several
  own.pass_i.z() = add_gathered ? 1 : 0;
  list.fill(*grid.of_virtual, 0);
  dispatch_list(
      list, *virtual_,
      joined(volumes.bindings(), {gpu::storage(28, *volumes.listed_virtual), gpu::storage(15, *volumes.virtual_area),
                                  gpu::image(25, *volumes.virtual_radiance), gpu::image(26, *volumes.gathered_virtual),
                                  gpu::storage(16, *grid.of_virtual), gpu::image(17, *grid.from_low)}),
      own);
}

void LpvInject::at_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
                        const LpvGrid& grid) const {
  list.fill(*grid.of_real, 0);
  dispatch_list(list, *real_,
                joined(volumes.bindings(), {gpu::storage(28, *volumes.listed_real),
                                            gpu::image(26, *volumes.real_change), gpu::image(27, *volumes.real_normal),
                                            gpu::storage(16, *grid.of_real), gpu::image(17, *grid.from_low)}),
                with_units(params, grid));
}

void LpvInject::sum(gpu::CommandList& list, const shader::FrameParams& params, const LpvGrid& grid) const {
  dispatch_cascades(list, *sum_,
                    {gpu::storage(15, *grid.of_virtual), gpu::storage(16, *grid.of_real),
                     gpu::image(12, *grid.source[0]), gpu::image(13, *grid.source[1]), gpu::image(14, *grid.source[2])},
                    with_units(params, grid), grid.edge);
}

}  // namespace lumigraft::relight
