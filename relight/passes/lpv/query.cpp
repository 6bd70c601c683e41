#include "relight/passes/lpv/query.h"

namespace lumigraft::relight {
namespace {

std::vector<gpu::Binding> inputs(const LpvGrid& grid, const Volumes& volumes) {
  using gpu::Filter;
  return joined(volumes.bindings(),
                {gpu::sampled(7, *grid.light[0], Filter::linear), gpu::sampled(8, *grid.light[1], Filter::linear),
                 gpu::sampled(9, *grid.light[2], Filter::linear), gpu::sampled(10, *grid.from_low, Filter::linear)});
}

}  // namespace

LpvQuery::LpvQuery(gpu::Device& device)
    : cells_(device.create_compute("lpv_cells.comp")), pixels_(device.create_compute("lpv_pixels.comp")) {}

void LpvQuery::cells(gpu::CommandList& list, shader::FrameParams params, int cones, const LpvGrid& grid,
                     const gpu::Texture& beyond, const Volumes& volumes) const {
  params.pass_i.x() = grid.edge;
  params.pass_i.y() = cones;
  list.dispatch(
      *cells_,
      joined(inputs(grid, volumes),
             {gpu::storage(28, *volumes.cells), gpu::image(18, *volumes.real_irradiance),
              gpu::image(25, *volumes.real_radiance), gpu::image(26, *volumes.real_normal), gpu::image(27, beyond)}),
      gpu::bytes_of(params), kListGroups);
}

void LpvQuery::pixels(gpu::CommandList& list, shader::FrameParams params, const LpvGrid& grid,
                      const gpu::Texture& beyond, const Volumes& volumes, const Screen& screen) const {
  params.pass_i.x() = grid.edge;
  dispatch_tiles(
      list, *pixels_,
      joined(inputs(grid, volumes), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                     gpu::sampled(14, beyond, gpu::Filter::linear), gpu::image(16, *screen.indirect)}),
      params, screen.tiles->changed());
}

}  // namespace lumigraft::relight
