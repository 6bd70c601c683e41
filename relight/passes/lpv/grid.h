#pragma once
// Textures of the delta light propagation volumes: two cascades of cells, stacked along z, over the same cubes as those
// of Volumes. Their content is defined in shaders/lpv/lpv_kernel.h.
#include <array>
#include <memory>

#include "relight/gpu/device.h"

namespace lumigraft::relight {

struct LpvGrid {
  using Light = std::array<std::unique_ptr<gpu::Texture>, 3>;  ///< red, green, blue: Φ and J, W per cell

  int edge = 0;                                       ///< cells along the edge of a cascade
  std::unique_ptr<gpu::Texture> from_low, from_high;  ///< fraction of the neighbours' light that enters; open volume
  std::unique_ptr<gpu::Buffer> of_virtual, of_real;   ///< sources at virtual and at real surfaces, fixed point
  Light source, light;

  LpvGrid(gpu::Device& device, int edge_cells);
};

/// Cells along the edge for a volume of so many voxels: cells of 2³ voxels, at most 64 (thesis §5.3.5: 32 to 64).
int lpv_edge(int edge_voxels);

}  // namespace lumigraft::relight
