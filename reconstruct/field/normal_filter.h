#pragma once
// Bilateral filter of normals (Zheng, Fu, Au & Tai 2011, "Bilateral Normal Filtering for Mesh Denoising"). Depth of a
// few images is so noisy that a plane at 2 m has normals that are off by 10°, and its light by a fifth.
#include "reconstruct/field/surface_mesh.h"

namespace lumigraft::reconstruct {

/// Averages normals over neighbouring vertices, as far as they differ by no more than noise explains. What is known
/// well is not changed: the noise of a normal follows from the weight of its voxel, and from how much the mesh's
/// normals differ from those around them.
void filter_normals(const DistanceField& field, SurfaceMesh& mesh);

}  // namespace lumigraft::reconstruct
