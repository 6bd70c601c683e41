#pragma once
// Lamps that the depth camera sees. They are fused as surface, whose place is known better than one from shading. Rays
// of light must not end there: the surface would occlude the lamp that it is, and its radiance would be counted twice.
#include <map>
#include <memory>
#include <optional>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/masked_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A lamp is seen if surface covers most of its disk that is as bright as the lamp, or clipped in all colour frames and
/// no larger than the lamp. Darker surface is behind it, or reflects it (lamp_reflections.h).
class SeenLamps {
 public:
  struct Result {
    /// With the places of these lamps as `distance_known`, planes as `flat`; the same pointer if none is seen. A lamp
    /// with a tag keeps the tag's place.
    std::shared_ptr<const Illumination> light;
    std::shared_ptr<const SurfaceMask> surface;  ///< of these lamps; null if none is seen
  };
  /// Light that was estimated from shading has no lamps to look for. A lamp that something covers, or that is hidden,
  /// stays where it was.
  Result find(const DistanceField& field, const std::shared_ptr<const Illumination>& light);

 private:
  struct Seen {
    PointLight lamp;  ///< with its place
    SurfaceMask surface;
  };
  static std::optional<Seen> look(const DistanceField& field, const PointLight& lamp, const Illumination& light);

  std::map<int, Seen> seen_;  ///< by the lamp's id
  std::shared_ptr<const SurfaceMask> surface_;
};

}  // namespace lumigraft::reconstruct
