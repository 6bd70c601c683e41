#pragma once
// Surfaces with an alpha mask, made opaque: triangles are cut along the contour where alpha is the cutoff. So no
// renderer needs to know of alpha.
#include <memory>
#include <span>
#include <vector>

#include "capture/image.h"
#include "relight/exhibit/exhibit.h"
#include "relight/exhibit/model_corners.h"
#include "relight/exhibit/source_mixes.h"

namespace lumigraft::relight {

/// A surface is opaque where factor × texture is at least the cutoff.
struct AlphaMask {
  std::shared_ptr<const capture::Image<std::uint8_t>> alpha;  ///< 1 channel; null: 1 everywhere
  Model::TextureSlot slot;                                    ///< how it lies on the surface; its picture is not used
  float factor = 1, cutoff = 0.5f;
};

/// The opaque part of triangles, three corners each. Alpha is interpolated bilinearly between texels, and linearly
/// along pieces of the contour, which are a texel or two long, or longer where there would be very many; at worst only
/// alpha at the triangles' corners counts. New corners of an animated model are numbered in `mixes`.
std::vector<Corner> cut_out(std::span<const Corner> corners, const AlphaMask& mask, SourceMixes& mixes);

}  // namespace lumigraft::relight
