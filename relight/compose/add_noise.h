#pragma once
// Gives virtual objects, and real pixels that were darkened or brightened, the camera's noise at their level.
#include <cstdint>

#include "capture/image.h"
#include "relight/compose/object_layer.h"
#include "relight/look/noise_model.h"

namespace lumigraft::relight {

/// `picture`: composed over `camera`, both sRGB. A real pixel was multiplied by what it changed by, and its noise with
/// it; what is missing to the noise of its new level is added. Nothing is added where it has more. `seed`: of the
/// frame.
void add_noise(const NoiseModel& noise, const capture::Image<std::uint8_t>& camera, const ObjectLayer& objects,
               std::uint64_t seed, capture::Image<std::uint8_t>* picture);

}  // namespace lumigraft::relight
