#pragma once
// Fills pixels of unknown surface or colour, as shaders/screen/hole_fill.glsl does.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Such pixels get the plane and albedo of the nearby pixel with the most similar colour. `exposure`: camera pixel
/// value over radiance, 1 at most.
void fill_holes(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure,
                std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
