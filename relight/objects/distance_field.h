#pragma once
// The signed distance field of a rigid virtual object, in the model's frame, computed once when the model is loaded.
//
// Voxel (i, j, k) has its centre at origin_m + voxel_m · (i, j, k); index i + nx (j + ny k). distance_m is exact within
// ± 3 voxels of the surface and clamped beyond; negative inside closed parts (parts with small holes, as in scans,
// count as closed). Open parts are shells: slightly more than half a voxel is subtracted from their distance, so they
// are a voxel thick. Closed parts thinner than that are thickened to it. So no part is too thin to be hit.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

struct ObjectField {
  std::array<int, 3> size{};
  Eigen::Vector3f origin_m = Eigen::Vector3f::Zero();
  float voxel_m = 0;
  std::vector<float> distance_m;
  // Of the nearest surface point, within 3 voxels of the surface.
  std::vector<Eigen::Vector3f> base_color;  ///< linear: texture, vertex colour and the part's base colour
  std::vector<float> metallic;              ///< of the material at the surface point
  std::vector<std::uint32_t> part;          ///< index into Model::parts
};

/// `edge_voxels` along the longest edge of the bounding box, plus a margin of three voxels on all sides.
std::shared_ptr<const ObjectField> compute_object_field(const Model& model, int edge_voxels);

/// The field's distances, so that cones can take long steps: where they are clamped, a lower bound of the true distance
/// that is at most 1.5 voxels too small, with the field's sign (Felzenszwalb & Huttenlocher 2012, exact Euclidean
/// transform of the surface voxels).
std::vector<float> full_distances(const ObjectField& field);

}  // namespace lumigraft::relight
