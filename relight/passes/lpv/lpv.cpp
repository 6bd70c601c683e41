#include "relight/passes/lpv/lpv.h"

#include <algorithm>
#include <numbers>

#include "relight/parameters.h"
#include "relight/passes/volume/surface_fill.h"
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

LpvGrid::LpvGrid(gpu::Device& device, int edge_cells) : edge(edge_cells) {
  const auto make = [&](const char* name, gpu::Format format) {
    return device.create_texture(gpu::volume_desc(name, edge, edge, edge * shader::kCascades, format));
  };
  from_low = make("open from low", gpu::Format::rgba16_float);
  from_high = make("open from high", gpu::Format::rgba16_float);
  for (std::size_t i = 0; i < 3; ++i) {
    source[i] = make("propagation's source", gpu::Format::rgba32_float);
    light[i] = make("propagated light", gpu::Format::rgba32_float);
  }
  const std::size_t cells = shader::kCascades * static_cast<std::size_t>(edge) * edge * edge;
  const std::size_t sums = 12 * sizeof(int) * cells;
  of_virtual = device.create_buffer(sums, "change at virtual surfaces");
  of_real = device.create_buffer(sums, "change at real surfaces");
}

Lpv::Lpv(gpu::Device& device)
    : block_(device.create_compute("lpv_blocking.comp")),
      virtual_(device.create_compute("lpv_virtual.comp")),
      real_(device.create_compute("lpv_real.comp")),
      sum_(device.create_compute("lpv_source.comp")),
      step_(device.create_compute("lpv_step.comp")),
      cells_(device.create_compute("lpv_cells.comp")),
      pixels_(device.create_compute("lpv_pixels.comp")) {}

void Lpv::fit(gpu::Device& device, int edge_voxels, int steps) {
  steps_ = steps;
  const int cells = edge_voxels / 2, edge = std::min(cells, 64);  // thesis §5.3.5: 32 to 64
  if (!grid_ || grid_->edge != edge) grid_ = std::make_unique<LpvGrid>(device, edge);
  if (beyond_ && beyond_->desc().width == cells) return;
  beyond_ = device.create_texture(
      gpu::volume_desc("change by the enclosure", cells, cells, cells * shader::kCascades, gpu::Format::rgba16_float));
}

void Lpv::gather_real(gpu::CommandList& list, const shader::FrameParams& params, float brightest, int round, int rounds,
                      const Volumes& volumes) {
  if (round == 0) {
    list.clear(*beyond_, {});
    list.begin_pass("blocking");
    choose_unit(params, brightest);
    block(list, params, volumes);
  }
  list.begin_pass("inject into cells");
  // With two rounds virtual surfaces have gathered once, before the first; with more they gather again.
  if (round == 0 || (rounds > 2 && round == rounds - 1)) at_virtual(list, params, round == 0, volumes);
  at_real(list, params, volumes);
  sum(list, params);
  list.begin_pass("propagate");
  // Every round continues from the previous result, and the changes since are weaker by one bounce.
  const int sweeps = (steps_ + 1) / 2, first_sweeps = round == 0 && rounds > 1 ? (2 * sweeps + 2) / 3 : sweeps;
  propagate(list, params, round == 0 ? first_sweeps : (first_sweeps + 1) / 2, round > 0);
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

void Lpv::choose_unit(const shader::FrameParams& params, float brightest) {
  // The lamps' part is that of the flux volumes (Inject::choose_unit). The objects' surface is assumed to be at most
  // that of their bounding sphere: as much light passes through it, and as much again is reflected.
  const double pi = std::numbers::pi, radius_m = params.sphere.w();
  const double lamps_W = 1e9 * static_cast<double>(params.field.w());
  const double even_W = 2 * 4 * pi * radius_m * radius_m * pi * brightest;
  unit_ = static_cast<float>(5e8 / (lamps_W + even_W));
}

shader::FrameParams Lpv::with_units(shader::FrameParams params) const {
  params.pass_i.x() = grid_->edge;
  params.pass_f << unit_, 1 / unit_, 1.0f / SurfaceFill::kUnitsPerFace, 0;
  return params;
}

void Lpv::block(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  params.pass_i.x() = grid_->edge;
  dispatch_cascades(list, *block_,
                    joined(volumes.bindings(), {gpu::image(12, *grid_->from_low), gpu::image(13, *grid_->from_high)}),
                    params, grid_->edge);
}

void Lpv::at_virtual(gpu::CommandList& list, const shader::FrameParams& params, bool add_gathered,
                     const Volumes& volumes) const {
  shader::FrameParams own = with_units(params);
  own.pass_i.y() = std::max(params.counts.z() / 2, 3);  // each voxel rotates them; a cell holds the mean of several
  own.pass_i.z() = add_gathered ? 1 : 0;
  list.fill(*grid_->of_virtual, 0);
  dispatch_list(
      list, *virtual_,
      joined(volumes.bindings(), {gpu::storage(28, *volumes.listed_virtual), gpu::storage(15, *volumes.virtual_area),
                                  gpu::image(25, *volumes.virtual_radiance), gpu::image(26, *volumes.gathered_virtual),
                                  gpu::storage(16, *grid_->of_virtual), gpu::image(17, *grid_->from_low)}),
      own);
}

void Lpv::at_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const {
  list.fill(*grid_->of_real, 0);
  dispatch_list(list, *real_,
                joined(volumes.bindings(), {gpu::storage(28, *volumes.listed_real),
                                            gpu::image(26, *volumes.real_change), gpu::image(27, *volumes.real_normal),
                                            gpu::storage(16, *grid_->of_real), gpu::image(17, *grid_->from_low)}),
                with_units(params));
}

void Lpv::sum(gpu::CommandList& list, const shader::FrameParams& params) const {
  dispatch_cascades(
      list, *sum_,
      {gpu::storage(15, *grid_->of_virtual), gpu::storage(16, *grid_->of_real), gpu::image(12, *grid_->source[0]),
       gpu::image(13, *grid_->source[1]), gpu::image(14, *grid_->source[2])},
      with_units(params), grid_->edge);
}

void Lpv::propagate(gpu::CommandList& list, shader::FrameParams params, int sweeps, bool go_on) const {
  params.pass_i.x() = grid_->edge;
  if (!go_on) {
    for (const auto& texture : grid_->light) list.clear(*texture, {});
  }
  const std::vector<gpu::Binding> bindings{gpu::image(1, *grid_->source[0]), gpu::image(2, *grid_->source[1]),
                                           gpu::image(3, *grid_->source[2]), gpu::image(4, *grid_->light[0]),
                                           gpu::image(5, *grid_->light[1]),  gpu::image(6, *grid_->light[2]),
                                           gpu::image(7, *grid_->from_low),  gpu::image(8, *grid_->from_high)};
  for (int i = 0; i < 2 * sweeps; ++i) {
    params.pass_i.y() = i % 2;
    dispatch_3d(list, *step_, bindings, params, grid_->edge / 2, grid_->edge, grid_->edge * shader::kCascades);
  }
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
