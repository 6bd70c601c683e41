#pragma once
// Power of tagged lamps that the fish-eye does not see, from the shading of the room.
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

class OutOfViewLamps {
 public:
  /// Marks such lamps as clipped at a very low power, so that locate_lamps estimates their power. Removes those that
  /// are visibly off: in view and not occluded.
  OutOfViewLamps(Illumination& light, const FieldRays& rays);

  /// After locate_lamps: removes lamps that are off, and restores the previous or configured power of those that
  /// shading does not determine. No lamp that stays is `dark`. `named`: Session::lamps, for warnings.
  void resolve(Illumination& light, const std::vector<capture::TaggedLamp>& named,
               std::vector<std::string>& warnings) const;

 private:
  struct Prior {
    int id;
    Eigen::Vector3f irradiance;
    float log_sigma;
  };
  std::vector<Prior> priors_;  ///< power before the estimate
  float all_light_ = 0;        ///< at the probe, mean of channels
};

}  // namespace lumigraft::reconstruct
