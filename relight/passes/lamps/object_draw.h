#pragma once
// Draw calls of virtual objects, one per part.
#include <deque>

#include "relight/shaders/common/interop.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// Draw calls keep spans into `params`, which must outlive their recording.
struct ObjectDraws {
  std::deque<shader::DrawParams> params;
  std::vector<gpu::DrawCall> calls;

  /// `view` holds the parameters common to all parts: T_view_tag, projection, distortion, more. `white_radiance`: as in
  /// PlacedObject. `glass`: number of the object's Glass + 1.
  void add(const StoredModel::Mesh& mesh, const Eigen::Affine3f& T_tag_model, const MaterialOverride& material,
           float white_radiance, int number, const shader::DrawParams& view, const gpu::Texture& white, int glass = 0);
};

/// T_view_tag of a view from a point in a unit direction, its z.
Eigen::Matrix4f view_along(const Eigen::Vector3f& from, const Eigen::Vector3f& direction);

}  // namespace lumigraft::relight
