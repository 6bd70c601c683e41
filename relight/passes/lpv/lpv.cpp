#include "relight/passes/lpv/lpv.h"

#include "relight/parameters.h"
#include "relight/quality.h"

namespace lumigraft::relight {
namespace {

/// Of both look-ups.
std::vector<gpu::Binding> inputs(const LpvGrid& grid, const Volumes& volumes) {
  using gpu::Filter;
  return joined(volumes.bindings(),
                {gpu::sampled(7, *grid.light[0], Filter::linear), gpu::sampled(8, *grid.light[1], Filter::linear),
                 gpu::sampled(9, *grid.light[2], Filter::linear), gpu::sampled(10, *grid.from_low, Filter::linear)});
}

}  // namespace

Lpv::Lpv(gpu::Device& device)
    : inject_(device),
      propagate_(device),
      cells_(device.create_compute("lpv_cells.comp")),
      pixels_(device.create_compute("lpv_pixels.comp")) {}

void Lpv::fit(gpu::Device& device, int edge_voxels, int steps) {
  steps_ = steps;
  if (!grid_ || grid_->edge != lpv_edge(edge_voxels)) grid_ = std::make_unique<LpvGrid>(device, lpv_edge(edge_voxels));
  const int cells = edge_voxels / 2;
  if (beyond_ && beyond_->desc().width == cells) return;
  beyond_ = device.create_texture(
      gpu::volume_desc("change by the enclosure", cells, cells, cells * shader::kCascades, gpu::Format::rgba16_float));
}

void Lpv::gather_real(gpu::CommandList& list, const shader::FrameParams& params, float brightest, int round, int rounds,
                      const Volumes& volumes) {
  if (round == 0) {
    list.clear(*beyond_, {});
    list.begin_pass("blocking");
    inject_.choose_unit(params, brightest);
    inject_.block(list, params, volumes, *grid_);
  }
  list.begin_pass("inject into cells");
  // With two rounds virtual surfaces have gathered once, before the first; with more they gather again.
  if (round == 0 || (rounds > 2 && round == rounds - 1)) inject_.at_virtual(list, params, round == 0, volumes, *grid_);
  inject_.at_real(list, params, volumes, *grid_);
  inject_.sum(list, params, *grid_);
  list.begin_pass("propagate");
  // Every round continues from the previous result, and the changes since are weaker by one bounce.
  const int sweeps = (steps_ + 1) / 2, first_sweeps = round == 0 && rounds > 1 ? (2 * sweeps + 2) / 3 : sweeps;
  propagate_.record(list, params, round == 0 ? first_sweeps : (first_sweeps + 1) / 2, round > 0, *grid_);
  list.begin_pass("look up");
  shader::FrameParams query = params;
  query.pass_i.x() = grid_->edge;
  // The enclosure's change is only available before the last round.
  query.pass_i.y() = params.probe.w() > 0 && round == rounds - 1 ? kRelight.change_cones : 0;
  dispatch_list(
      list, *cells_,
      joined(inputs(*grid_, volumes),
             {gpu::storage(28, *volumes.cells), gpu::image(18, *volumes.real_irradiance),
              gpu::image(25, *volumes.real_radiance), gpu::image(26, *volumes.real_normal), gpu::image(27, *beyond_)}),
      query);
}

void Lpv::look_up(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                  const Screen& screen) const {
  params.pass_i.x() = grid_->edge;
  dispatch_tiles(list, *pixels_,
                 joined(inputs(*grid_, volumes),
                        {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                         gpu::sampled(14, *beyond_, gpu::Filter::linear), gpu::image(16, *screen.indirect)}),
                 params, screen.tiles->changed());
}

}  // namespace lumigraft::relight
