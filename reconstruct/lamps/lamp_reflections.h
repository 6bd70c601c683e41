#pragma once
// Removal of false lamps: mirror images of a lamp in a known surface.
#include <cstddef>
#include <map>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A lamp whose whole disk lies behind known surface that is much darker in the colour image is a reflection; it is
/// moved into the environment. A real lamp is clipped in the colour image, so the field has no radiance there. So is a
/// bright place on known surface that faces up, as the tag does: paper or a floor under a lamp, or glare on it. And so
/// is the image of another lamp in the plane that the tag lies on, where the field does not reach but the plane does.
Illumination without_reflections(const Illumination& illumination, const DistanceField& field, const FieldRays& rays);

/// The same from solution to solution. What was found to be a lamp stays one until much more of the room is known: who
/// walks before it becomes surface that hides it.
class ReflectionFilter {
 public:
  Illumination without_reflections(const Illumination& illumination, const DistanceField& field, const FieldRays& rays);

 private:
  struct Lamp {
    Eigen::Vector3f direction;
    std::size_t bricks;  ///< of the field then
  };
  std::map<int, Lamp> lamps_;  ///< by id
};

}  // namespace lumigraft::reconstruct
