#pragma once
// The textures of delta light propagation volumes: two cascades of cells, one above the other along z, over the same
// cubes as those of Volumes. What they hold is said in shaders/lpv_kernel.h.
#include <array>
#include <memory>

#include "relight/gpu/device.h"

namespace lumigraft::relight {

struct LpvGrid {
  using Light = std::array<std::unique_ptr<gpu::Texture>, 3>;  ///< red, green, blue: Φ and J, W per cell

  int edge = 0;                                       ///< cells along the edge of a cascade
  std::unique_ptr<gpu::Texture> from_low, from_high;  ///< share of the neighbours' light that gets in; open volume
  std::unique_ptr<gpu::Buffer> of_virtual, of_real;   ///< sources at either kind of surface, fixed point
  Light source, light;

  LpvGrid(gpu::Device& device, int edge_cells);
};

/// Cells along the edge for volumes of so many voxels: of 2³ voxels, and not more than 64 (thesis §5.3.5: 32 to 64).
int lpv_edge(int edge_voxels);

}  // namespace lumigraft::relight
