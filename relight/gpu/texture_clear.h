#pragma once
// Clears textures to 0 by compute shaders. The driver of a card may do so by drawing, which took twelve times as long
// on one for data centres, where few processors draw (tests/bench/results/README.md).
#include <array>
#include <memory>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

class TextureClear {
 public:
  explicit TextureClear(Device& device);
  /// False if it has no shader for such a texture or such a value: nothing is recorded.
  bool record(CommandList& list, const Texture& texture, const std::array<float, 4>& value) const;

 private:
  std::unique_ptr<ComputePipeline> half_picture_, float_picture_, half_volume_, float_volume_;
};

}  // namespace lumigraft::relight::gpu
