#pragma once
// Albedo of surface that clips in all frames.
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/shading/irradiance.h"

namespace lumigraft::reconstruct {

/// Where the field has only lower bounds of radiance, π B / E is a lower bound of albedo (Tobin 1958), in channels that
/// do not clip albedo itself. Each connected area has the largest bound that its surface shows, as light varies over
/// it. In clipped channels it gets the albedo with which its surface continues beyond its border, or that of its
/// brightest other channel, or the middle between the bound and white. Metal has none. `bricks`: albedo of the field's
/// coloured surface; gets that of the areas. `light`: in which the albedo was solved; `room`: its other light.
void extend_to_clipped(const DistanceField& field, const MetalMask& metal, const IrradianceModel& room,
                       const Illumination& light, BrickMap<AlbedoBrick>& bricks);

}  // namespace lumigraft::reconstruct
