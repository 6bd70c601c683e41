#pragma once
// Fewer triangles for the same shape, for maps in which no one sees the silhouette.
#include <memory>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// The model with at most about `max_triangles`, shared out over its parts by their size; parts, textures, colours and
/// normals stay, and vertices are a subset of the model's. Edges collapse by quadric error (Garland & Heckbert 1997);
/// a part whose seams stop that is clustered on a grid (Rossignac & Borrel 1993), which may tear it open.
/// A model that is small enough is copied as it is.
std::shared_ptr<const Model> simplify_model(const Model& model, int max_triangles);

}  // namespace lumigraft::relight
