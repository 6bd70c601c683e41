#pragma once
// The real room that the light volumes hold, which follows the scene's no faster than it needs to.
#include <memory>

#include "reconstruct/scene.h"

namespace lumigraft::relight {

class SceneUpdateThrottle {
 public:
  /// Every depth picture changes the field a little, ever less as it is looked at longer: this follows at once in the
  /// beginning and lags behind by a quarter of its age, 24 publications at most, later; while less than a tenth of its
  /// bricks and of the albedo's have changed it waits for 64. `scene` has a field.
  void follow(const reconstruct::Scene& scene);

  const std::shared_ptr<const reconstruct::DistanceField>& field() const { return field_; }
  const std::shared_ptr<const reconstruct::AlbedoField>& albedo() const { return albedo_; }

 private:
  std::shared_ptr<const reconstruct::DistanceField> field_;
  std::shared_ptr<const reconstruct::AlbedoField> albedo_;
};

}  // namespace lumigraft::relight
