#pragma once
// Compute dispatches with one thread per texel, in the local sizes of all passes' shaders.
#include "relight/gpu/device.h"
#include "relight/passes/parameters.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

/// 8 × 8 threads per group.
inline void dispatch_2d(gpu::CommandList& list, const gpu::ComputePipeline& pipeline,
                        const std::vector<gpu::Binding>& bindings, const shader::FrameParams& params, int width,
                        int height) {
  list.dispatch(pipeline, bindings, gpu::bytes_of(params), (width + 7) / 8, (height + 7) / 8);
}

constexpr int kTile_px = 8;

/// Blocks of 8 × 8 texels, on the GPU as column | row << 16 (shaders/common/tiles.glsl).
struct TileList {
  std::unique_ptr<gpu::Buffer> buffer;
  int count = 0;
};

/// 8 × 8 threads per listed block.
inline void dispatch_tiles(gpu::CommandList& list, const gpu::ComputePipeline& pipeline,
                           std::vector<gpu::Binding> bindings, const shader::FrameParams& params,
                           const TileList& tiles) {
  if (tiles.count == 0) return;
  bindings.push_back(gpu::storage(29, *tiles.buffer));
  list.dispatch(pipeline, bindings, gpu::bytes_of(params), tiles.count);
}

/// Part of a list to process (shaders/common/slice.glsl).
struct Slice {
  int number = 0, of = 1;
};

/// That share a list of unknown length. Each costs time on software devices, with work or without.
inline int groups_of_list(const gpu::CommandList& list) {
  return list.is_software() ? kPasses.list_groups_software : kPasses.list_groups;
}

/// Groups of 64 threads iterate over the slice together. On hardware a slice has as many as the whole list, which they
/// would not fill otherwise.
inline void dispatch_slice(gpu::CommandList& list, const gpu::ComputePipeline& pipeline,
                           const std::vector<gpu::Binding>& bindings, shader::FrameParams params, Slice slice) {
  const int groups = groups_of_list(list);
  params.pass_i.z() = slice.number;
  params.pass_i.w() = slice.of;
  list.dispatch(pipeline, bindings, gpu::bytes_of(params),
                list.is_software() ? (groups + slice.of - 1) / slice.of : groups);
}

/// 8 × 4 × 2 threads per group.
inline void dispatch_3d(gpu::CommandList& list, const gpu::ComputePipeline& pipeline,
                        const std::vector<gpu::Binding>& bindings, const shader::FrameParams& params, int x, int y,
                        int z) {
  list.dispatch(pipeline, bindings, gpu::bytes_of(params), (x + 7) / 8, (y + 3) / 4, (z + 1) / 2);
}

/// One thread per texel of a volume of two cascades, `edge` texels along each axis.
inline void dispatch_cascades(gpu::CommandList& list, const gpu::ComputePipeline& pipeline,
                              const std::vector<gpu::Binding>& bindings, const shader::FrameParams& params, int edge) {
  dispatch_3d(list, pipeline, bindings, params, edge, edge, edge * shader::kCascades);
}

/// Groups of 64 threads iterate over the whole list together.
inline void dispatch_list(gpu::CommandList& list, const gpu::ComputePipeline& pipeline,
                          const std::vector<gpu::Binding>& bindings, const shader::FrameParams& params) {
  list.dispatch(pipeline, bindings, gpu::bytes_of(params), groups_of_list(list));
}

inline std::vector<gpu::Binding> joined(std::vector<gpu::Binding> a, const std::vector<gpu::Binding>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace lumigraft::relight
