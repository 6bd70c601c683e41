#pragma once
// What of a room outlives a run of the program.
#include <memory>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/lamps/kept_lamp.h"

namespace lumigraft::reconstruct {

/// Its surfaces, their albedo, and where its lamps are. Radiance is not kept: it belongs to the light of then.
/// Viewpoints are not kept, since what they saw as free may no longer be.
struct KeptRoom {
  DistanceField field;                        ///< with its coarse field; of one that is read the radiance is unknown
  std::shared_ptr<const AlbedoField> albedo;  ///< null: unknown. Of one that is read, sigma is sigma_later
  float albedo_error = 0;                     ///< common_error of the light in which it was solved
  std::vector<KeptLamp> lamps;
};

}  // namespace lumigraft::reconstruct
