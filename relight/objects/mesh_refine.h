#pragma once
// More triangles for the same shape, so that what is kept by vertex has enough of them.
#include <memory>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The model with every edge that is longer than `longest_m` halved until none is. Both triangles at an edge halve it
/// alike, so no gap opens. Attributes are linear along edges. Colours, textures and parts stay.
std::shared_ptr<const Model> refine_model(const Model& model, float longest_m);

/// Whether every edge joins two triangles that run it in opposite ways; vertices at one place count as one.
bool is_closed(const Model& model);

}  // namespace lumigraft::relight
