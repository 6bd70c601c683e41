#pragma once
// What places that the colour camera sees again show of the light: lamps that are off or lit while the fish-eye does
// not see them, the powers of lamps since its newest image, and shadows.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/exposure/surface_cells.h"
#include "reconstruct/light/lamp_shadows.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Places of a frame, what they sent before, and the camera's gain since.
struct PlacesSeenAgain {
  const std::vector<Place>& places;
  const SurfaceCells& cells;
  Eigen::Array3f gain;
};

/// Tries each hidden lamp, the strongest first, lit and switched off. Surface that the lamp hardly lights says nothing.
/// Where all went out together no lamp alone explains the frame, so the others are supposed lit or off as fits better.
SeenByColor check_hidden(const PlacesSeenAgain& seen, const Illumination& light);

/// How the light changed since it agreed with a frame; empty if the places do not determine it (fit_dimming).
std::optional<Dimming> dimming_since(const std::shared_ptr<const Illumination>& agreed, const PlacesSeenAgain& seen);

/// Shadows of what moved; see observe_shadows.
std::shared_ptr<const LampShadows> shadows_seen(const PlacesSeenAgain& seen,
                                                const std::vector<Eigen::Vector3f>& moved_m,
                                                const std::shared_ptr<const Illumination>& light);

}  // namespace lumigraft::reconstruct
