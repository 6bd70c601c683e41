#include "relight/passes/lpv/lpv.h"

#include "relight/quality.h"

namespace lumigraft::relight {

Lpv::Lpv(gpu::Device& device) : inject_(device), propagate_(device), query_(device) {}

void Lpv::fit(gpu::Device& device, int edge_voxels, int steps) {
  steps_ = steps;
  if (!grid_ || grid_->edge != lpv_edge(edge_voxels)) grid_ = std::make_unique<LpvGrid>(device, lpv_edge(edge_voxels));
  const int cells = edge_voxels / 2;
  if (beyond_ && beyond_->desc().width == cells) return;
  beyond_ = device.create_texture({.name = "change by the enclosure",
                                   .width = cells,
                                   .height = cells,
                                   .depth = cells * shader::kCascades,
                                   .volume = true,
                                   .format = gpu::Format::rgba16_float});
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
  if (round == 0 || (rounds > 2 && round == rounds - 1)) {
    inject_.at_virtual(list, params, round == 0, volumes, *grid_);
  }
  inject_.at_real(list, params, volumes, *grid_);
  inject_.sum(list, params, *grid_);
  list.begin_pass("propagate");
  // Every round continues from the previous result, and the changes since are weaker by one bounce.
  const int sweeps = (steps_ + 1) / 2, first_sweeps = round == 0 && rounds > 1 ? (2 * sweeps + 2) / 3 : sweeps;
  propagate_.record(list, params, round == 0 ? first_sweeps : (first_sweeps + 1) / 2, round > 0, *grid_);
  list.begin_pass("look up");
  const bool enclosed = params.probe.w() > 0 && round == rounds - 1;  // the enclosure's change is only available before
                                                                      // the last round
  query_.cells(list, params, enclosed ? kChangeCones : 0, *grid_, *beyond_, volumes);
}

void Lpv::look_up(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
                  const Screen& screen) const {
  query_.pixels(list, params, *grid_, *beyond_, volumes, screen);
}

}  // namespace lumigraft::relight
