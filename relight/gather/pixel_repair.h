#pragma once
// Improves pixels of the G-buffer from the image and their neighbours. `exposure`: camera pixel value over radiance, 1
// at most. Pixels in `tiles` are improved, by those and others.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Pixels of unknown surface or colour get the plane and albedo of the nearby pixel with the most similar colour, as in
/// shaders/screen/hole_fill.glsl. So do those that only show the modelled enclosure, through a hole of the surfaces
/// that depth has seen, if that pixel's plane is nearer and its colour more similar than what the enclosure's radiance
/// is.
void fill_holes(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure,
                const TileMask& tiles, std::vector<GBufferPixel>& seen);

/// Restores sharp edges and creases, which the voxel field rounds off. Where two planes meet, the fused normals within
/// about two voxels of the edge turn from one plane to the other, which gives wrong lamp light there. Such pixels get
/// the plane and the albedo of the side they belong to: the side that the pixel's ray hits according to the planes'
/// intersection, or, near it, the side whose colour is more similar. Pixels without two adjacent planes are unchanged:
/// curved surfaces, ends, clutter.
void sharpen_edges(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure, float voxel_m,
                   const TileMask& tiles, std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
