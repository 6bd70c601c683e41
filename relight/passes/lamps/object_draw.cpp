#include "relight/passes/lamps/object_draw.h"

namespace lumigraft::relight {

Eigen::Matrix4f view_along(const Eigen::Vector3f& from, const Eigen::Vector3f& direction) {
  Eigen::Matrix3f rotation;
  rotation.row(2) = direction;
  rotation.row(0) = rotation.row(2).unitOrthogonal();
  rotation.row(1) = rotation.row(2).cross(rotation.row(0));
  Eigen::Matrix4f T_view_tag = Eigen::Matrix4f::Identity();
  T_view_tag.topLeftCorner<3, 3>() = rotation;
  T_view_tag.topRightCorner<3, 1>() = -rotation * from;
  return T_view_tag;
}

void ObjectDraws::add(const StoredModel::Mesh& mesh, const Eigen::Affine3f& T_tag_model,
                      const MaterialOverride& material, int number, const shader::DrawParams& view,
                      const gpu::Texture& white) {
  for (const auto& part : mesh.parts) {
    if (part.index_count == 0) continue;
    const Material combined = material.over(part.material);
    const bool own_color = !material.base_color, textured = part.texture && own_color;
    shader::DrawParams& p = params.emplace_back(view);
    p.T_tag_model = T_tag_model.matrix();
    p.base_color << combined.base_color, textured ? 1 : 0;
    p.tint << (own_color ? 1.0f : 0.0f), 0, 0, 0;
    p.material << combined.roughness, combined.metallic, combined.specular, static_cast<float>(number + 1);
    gpu::DrawCall& call = calls.emplace_back();
    call.bindings = {gpu::sampled(1, textured ? *part.texture : white, gpu::Filter::linear)};
    call.params = gpu::bytes_of(p);
    call.vertices = mesh.vertices.get();
    call.indices = part.indices.get();
    call.index_count = part.index_count;
  }
}

}  // namespace lumigraft::relight
