#pragma once
// Light of a room that no fish-eye sees, from the shading that the colour camera sees.
//
// The model: one to a few lamps, the same unknown radiance from every direction in which nothing is known, and the
// measured radiance of known surface. Surfaces of equal albedo must shade alike (lamp_posterior.h, robust_cost), and
// cast shadows show best where a lamp is. Lamps are added one by one, each the best of a grid of directions and
// distances, as long as each explains much of what the others leave. The absolute scale follows from the tag's white
// paper, and without it, loosely, from the typical albedo of rooms.
#include <memory>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

class LightFromShading {
 public:
  explicit LightFromShading(const capture::Session& session);

  /// Illumination::from_shading around a point above the tag. The same pointer as before until much more surface is
  /// known; null while none is. The lamps' uncertainty is wide.
  std::shared_ptr<const Illumination> estimate(const DistanceField& field);

 private:
  MetalMask metal_;
  double print_m_;  ///< edge of the tag with its paper
  std::size_t bricks_ = 0;
  std::shared_ptr<const Illumination> last_;
};

}  // namespace lumigraft::reconstruct
