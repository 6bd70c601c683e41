#pragma once
// The version of the real room in the light volumes; it follows the scene's updates no faster than necessary.
#include <memory>

#include "reconstruct/scene.h"

namespace lumigraft::relight {

class SceneUpdateThrottle {
 public:
  /// Every depth frame changes the field a little, by decreasing amounts the longer it is observed. So this follows
  /// every publication at first and lags later by a quarter of the scene's age, at most 24 publications; while less
  /// than a tenth of the bricks of distance and albedo changed, by 64. Other occluders
  /// are followed at once. `scene` must have a field.
  void follow(const reconstruct::Scene& scene);

  const std::shared_ptr<const reconstruct::DistanceField>& field() const { return field_; }
  const std::shared_ptr<const reconstruct::AlbedoField>& albedo() const { return albedo_; }

 private:
  std::shared_ptr<const reconstruct::DistanceField> field_;
  std::shared_ptr<const reconstruct::AlbedoField> albedo_;
};

}  // namespace lumigraft::relight
