#include "relight/passes/volume/filter.h"

namespace lumigraft::relight {

void Filter::record(gpu::CommandList& list, shader::FrameParams params, const ChunkSet& chunks,
                    const gpu::Texture& pool, const Volumes& volumes) const {
  const std::vector<gpu::Binding> bindings{gpu::image(1, pool), gpu::storage(2, chunks.places()), volumes.chunks()};
  for (int level = 1; level < volumes.mips; ++level) {
    if (chunks.count(level) == 0) continue;
    params.pass_i << chunks.first(level), level, static_cast<int>(chunks.kind()), 0;
    list.dispatch(*pipeline_, bindings, gpu::bytes_of(params), chunks.count(level));
  }
}

}  // namespace lumigraft::relight
