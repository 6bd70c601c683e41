#pragma once
// How much of the light each part of an illumination carries, at the probe.
#include <array>

#include "reconstruct/light/light.h"

namespace lumigraft::relight {

struct LightMeasures {
  float remainder_share = 0;  ///< of the remainder: of all light at the probe, ∫L dω
  /// By the last band of the remainder's harmonics that is kept: root of the mean squared irradiance of the higher
  /// ones, over the mean irradiance of all light, lamps too; both over all normals.
  std::array<float, 3> bands_left_out{};
};

LightMeasures measure_light(const reconstruct::Illumination& light);

}  // namespace lumigraft::relight
