#pragma once
// The real distance field and albedo on the GPU, as bricks behind a dense index. Bricks are immutable, so only those
// that changed since the last frame are packed again.
#include <Eigen/Geometry>
#include <memory>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"
#include "relight/gpu/device.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

class BrickPool {
 public:
  explicit BrickPool(gpu::Device& device);
  ~BrickPool();

  /// Takes the bricks of the field inside `region` (tag frame, metres). Returns true where anything changed.
  bool update(const std::shared_ptr<const reconstruct::DistanceField>& field,
              const std::shared_ptr<const reconstruct::AlbedoField>& albedo, const Eigen::AlignedBox3f& region);

  void describe(shader::FrameParams& params) const;     ///< bricks_low, bricks_size, field.xy
  std::vector<gpu::Binding> bindings() const;           ///< as bricks.glsl declares them
  std::vector<gpu::Binding> distance_bindings() const;  ///< those that distances need

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
