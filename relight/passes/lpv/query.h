#pragma once
// Change of irradiance on real surfaces.
// cells: in: light, cells, real_radiance, real_normal, enclosure_change; out: real_irradiance, beyond (the enclosure's
// part of it).
// pixels: in: light, beyond, real_position, real_normal; out: indirect.
#include "relight/passes/dispatch.h"
#include "relight/passes/lpv/grid.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class LpvQuery {
 public:
  explicit LpvQuery(gpu::Device& device);
  void cells(gpu::CommandList& list, shader::FrameParams params, int cones, const LpvGrid& grid,
             const gpu::Texture& beyond, const Volumes& volumes) const;
  void pixels(gpu::CommandList& list, shader::FrameParams params, const LpvGrid& grid, const gpu::Texture& beyond,
              const Volumes& volumes, const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> cells_, pixels_;
};

}  // namespace lumigraft::relight
