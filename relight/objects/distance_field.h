#pragma once
// The signed distance field of a rigid virtual object, in the model's frame, computed once when the model is loaded.
//
// Voxel (i, j, k) has its centre at origin_m + voxel_m · (i, j, k); index i + nx (j + ny k). distance_m is exact within
// ± 3 voxels of the surface and clamped beyond; negative inside closed parts (holes as small as a scan's count as
// closed). Open parts are shells: a hair more than half a voxel is taken off their distance, so they are a voxel thick.
// Closed parts thinner than that are thickened to it. So nothing is too thin to be hit.
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
  std::vector<Eigen::Vector3f> base_color;  ///< linear: texture, vertex colour and the part's own base colour
  std::vector<std::uint32_t> part;          ///< index into Model::parts
};

/// `edge_voxels` along the longest edge of the bounding box; three voxels of margin all around.
std::shared_ptr<const ObjectField> compute_object_field(const Model& model, int edge_voxels);

}  // namespace lumigraft::relight
