#include "relight/passes/lpv/grid.h"

#include <algorithm>

#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

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

int lpv_edge(int edge_voxels) { return std::min(edge_voxels / 2, 64); }

}  // namespace lumigraft::relight
