#pragma once
// Mesh simplification, for maps in which the silhouette is not visible.
#include <memory>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The model with at most about `max_triangles`, distributed over its parts by their size; parts, textures, colours and
/// normals are kept, and vertices are a subset of the model's. Edge collapse by quadric error (Garland & Heckbert
/// 1997); a part whose seams prevent that is clustered on a grid (Rossignac & Borrel 1993), which may open holes. A
/// model that is small enough is copied.
std::shared_ptr<const Model> simplify_model(const Model& model, int max_triangles);

}  // namespace lumigraft::relight
