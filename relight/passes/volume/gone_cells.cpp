#include "relight/passes/volume/gone_cells.h"

#include <span>
#include <utility>

namespace lumigraft::relight {

GoneCells::GoneCells(gpu::Device& device, int max_cells)
    : bits_(device.create_buffer(static_cast<std::size_t>((max_cells + 31) / 32) * sizeof(std::uint32_t),
                                 "surface that is gone")) {}

void GoneCells::take(gpu::Device& device, GoneGrid grid, shader::FrameParams& params) {
  changed_ = !(grid == grid_);
  grid_ = std::move(grid);
  if (changed_ && grid_.cell_m > 0) device.upload(*bits_, 0, std::as_bytes(std::span(grid_.bits)));
  params.gone << grid_.low_m, grid_.cell_m;
  if (changed_) ++grids_;
  params.gone_cells << grid_.size, grids_;
}

}  // namespace lumigraft::relight
