#pragma once
// What a pixel shows where nothing tells its surface or colour: as shaders/beside.glsl.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Such pixels take the plane and albedo of the pixel beside that looks most like them. `exposure`: radiance times that
/// is what the camera shows, 1 at most.
void fill_holes(const PosedCamera& camera, const capture::Image<float>& radiance, float exposure,
                std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
