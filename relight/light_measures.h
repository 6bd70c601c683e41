#pragma once
// Measures how much of the light at the probe each part of the illumination contributes.
#include <array>

#include "reconstruct/light/light.h"

namespace lumigraft::relight {

struct LightMeasures {
  float environment_fraction = 0;  ///< of all light at the probe, ∫L dω: contribution of the residual environment
  /// Truncation error by the last band of the residual environment's spherical harmonics that is kept: root mean square
  /// irradiance of the higher bands over the mean irradiance of all light including lamps, both over all normals.
  std::array<float, 3> bands_left_out{};
};

LightMeasures measure_light(const reconstruct::Illumination& light);

}  // namespace lumigraft::relight
