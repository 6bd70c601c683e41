#pragma once
// Shadows of what moved that the colour camera sees (reconstruct/light/lamp_shadows.h), per lamp. In: the scene's maps.
// Out: binding(), as declared in observed_shadows.glsl.
#include <memory>
#include <vector>

#include "reconstruct/light/lamp_shadows.h"
#include "relight/gpu/device.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

class ObservedShadows {
 public:
  explicit ObservedShadows(gpu::Device& device) { fit(device, 0); }

  /// `shadows`: null: none; `lamp_ids`: of the lamps of `params`, PointLight::id. Their number is written to it.
  void take(gpu::Device& device, const std::shared_ptr<const reconstruct::LampShadows>& shadows,
            const std::vector<int>& lamp_ids, shader::FrameParams& params);
  /// Whether the last two calls differ in shadows.
  bool changed() const { return changed_; }
  gpu::Binding binding() const { return gpu::storage(35, *buffer_); }

 private:
  void fit(gpu::Device& device, std::size_t values);

  std::shared_ptr<const reconstruct::LampShadows> shadows_;
  std::vector<int> lamp_ids_;
  int lamps_ = 0;  ///< with a map
  bool changed_ = false;
  std::unique_ptr<gpu::Buffer> buffer_;
};

}  // namespace lumigraft::relight
