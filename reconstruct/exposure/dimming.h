#pragma once
// How the room's light changed since the fish-eye's newest image, from the places that the colour camera sees again:
//
//   L / L₀ = (Σ_k s_k E_k + s E) / E₀      for each channel
//
// with E_k the irradiance of lamp k and E that of the environment in that image, and E₀ all irradiance when the place
// sent L₀. The powers s_k, s >= 0 minimize the sum of absolute log errors (iteratively reweighted least squares):
// shadows and what moved are outliers. Powers that the places do not determine tend to the median of L / L₀.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A place that is seen again.
struct DimmedPlace {
  Eigen::Array3f ratio;               ///< L / L₀; an upper bound if `dark`
  std::vector<Eigen::Array3f> parts;  ///< E_k / E₀ of each lamp, then E / E₀
  bool dark;
};

/// `light`: of the fish-eye's image. Empty if fewer than half of the places agree with any powers.
std::optional<Dimming> fit_dimming(const std::vector<DimmedPlace>& places, const Illumination& light);

}  // namespace lumigraft::reconstruct
