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
                      const MaterialOverride& material, float white_radiance, int number,
                      const shader::DrawParams& view, const gpu::Texture& white) {
  for (const auto& part : mesh.parts) {
    if (part.index_count == 0) continue;
    const Material combined = material.over(part.material);
    const bool own_color = !material.base_color, textured = part.base_color && own_color;
    const bool rough_map = part.metallic_roughness && !material.roughness,
               metal_map = part.metallic_roughness && !material.metallic;
    shader::DrawParams& p = params.emplace_back(view);
    p.T_tag_model = T_tag_model.matrix();
    p.base_color << combined.base_color, textured ? 1 : 0;
    p.tint << (own_color ? 1.0f : 0.0f), 0, 0, 0;
    p.material << (rough_map ? part.roughness_factor : combined.roughness),
        (metal_map ? part.metallic_factor : combined.metallic), combined.specular, static_cast<float>(number + 1);
    p.maps << (rough_map ? 1.0f : 0.0f), (metal_map ? 1.0f : 0.0f), (part.normals ? part.normal_scale : 0),
        (combined.gltf ? 1.0f : 0.0f);
    p.emission << white_radiance * combined.emission, 0;
    gpu::DrawCall& call = calls.emplace_back();
    const auto bound = [&](int slot, const gpu::Texture* texture) {
      return gpu::sampled(slot, texture ? *texture : white, gpu::Filter::repeated);
    };
    call.bindings = {bound(1, textured ? part.base_color : nullptr), bound(3, part.metallic_roughness),
                     bound(4, part.normals)};
    call.params = gpu::bytes_of(p);
    call.vertices = mesh.vertices.get();
    call.indices = part.indices.get();
    call.index_count = part.index_count;
  }
}

}  // namespace lumigraft::relight
