#pragma once
// Known state of the room at one moment. Immutable; stages publish parts at different rates and share the rest.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/lamp_shadows.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/pose.h"
#include "reconstruct/room/enclosure.h"

namespace lumigraft::reconstruct {

struct Scene {
  std::optional<Pose> pose;                          ///< empty: unknown, no tag is visible
  std::shared_ptr<const DistanceField> field;        ///< with inferred occluders; null until a depth frame is fused
  std::shared_ptr<const Illumination> illumination;  ///< null until it is measured or estimated
  std::shared_ptr<const AlbedoField> albedo;         ///< null until solved
  std::shared_ptr<const Enclosure> enclosure;        ///< null if no planes were found that close the unseen part
  std::vector<std::string> warnings;
  std::shared_ptr<const LampShadows> shadows;  ///< of what moved, in the newest colour frame; null: none
};

}  // namespace lumigraft::reconstruct
