#pragma once
// The power of marked lamps that the fish-eye does not show, from how the room is shaded.
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

class OutOfViewLamps {
 public:
  /// Makes such lamps ones that are clipped far below what they send, so that locate_lamps looks for their power;
  /// leaves out those that a free sight from the fish-eye shows to be off.
  OutOfViewLamps(Illumination& light, const FieldRays& rays);

  /// After their power was found: leaves out those that are off, and gives those the power back that was said before of
  /// which the shading says too little. `named` are the session's lamps, for warnings.
  void settle(Illumination& light, const std::vector<capture::TaggedLamp>& named,
              std::vector<std::string>& warnings) const;

 private:
  struct Said {
    int id;
    Eigen::Vector3f irradiance;
    float log_sigma;
  };
  std::vector<Said> said_;
  float all_light_ = 0;  ///< at the probe, mean of channels
};

}  // namespace lumigraft::reconstruct
