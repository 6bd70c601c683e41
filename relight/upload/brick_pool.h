#pragma once
// The real distance field and albedo on the GPU: bricks with a dense index. Bricks are immutable, so only those that
// changed since the last frame are uploaded again.
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

  /// Uploads the bricks of the field inside `region` (tag frame, metres). Returns whether anything changed.
  bool update(const std::shared_ptr<const reconstruct::DistanceField>& field,
              const std::shared_ptr<const reconstruct::AlbedoField>& albedo, const Eigen::AlignedBox3f& region);

  void describe(shader::FrameParams& params) const;     ///< fills bricks_low, bricks_size, field.xy
  std::vector<gpu::Binding> bindings() const;           ///< as declared in bricks.glsl
  std::vector<gpu::Binding> distance_bindings() const;  ///< the subset that distance look-ups need

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::relight
