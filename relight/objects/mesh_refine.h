#pragma once
// Mesh subdivision, so that per-vertex data has sufficient resolution.
#include <cstdint>
#include <memory>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The model with all edges longer than `longest_m` bisected until none is left. Both triangles of an edge bisect it at
/// the same point, so no gap opens. Attributes are interpolated linearly. Colours, textures and parts are kept.
std::shared_ptr<const Model> refine_model(const Model& model, float longest_m);

/// Adds the vertex in the middle between two others, and returns its number.
std::uint32_t add_middle(Model& model, std::uint32_t a, std::uint32_t b);

/// Whether every edge joins two triangles that traverse it in opposite directions; vertices at equal positions count as
/// one.
bool is_closed(const Model& model);

}  // namespace lumigraft::relight
