#pragma once
// Mesh subdivision, so that per-vertex data has sufficient resolution.
#include <memory>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The model with all edges longer than `longest_m` bisected until none is left. Both triangles of an edge bisect it at
/// the same point, so no gap opens. Attributes are interpolated linearly. Colours, textures and parts are kept.
std::shared_ptr<const Model> refine_model(const Model& model, float longest_m);

/// Whether every edge joins two triangles that traverse it in opposite directions; vertices at equal positions count as
/// one.
bool is_closed(const Model& model);

}  // namespace lumigraft::relight
