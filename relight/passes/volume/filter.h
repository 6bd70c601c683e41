#pragma once
// Builds the hierarchy of a pool of chunks, level by level. In: level 0, premultiplied by its weight. Out: the coarser
// levels.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Filter {
 public:
  explicit Filter(gpu::Device& device) : pipeline_(device.create_compute("chunk_mean.comp")) {}
  void record(gpu::CommandList& list, shader::FrameParams params, const ChunkSet& chunks, const gpu::Texture& pool,
              const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
