#include "relight/passes/lamps/object_draw.h"

#include <array>

#include "relight/exhibit/bsdf_params.h"
#include "relight/exhibit/sheen.h"

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

namespace {

gpu::Wrap wrap_of(Wrap wrap) {
  switch (wrap) {
    case Wrap::clamp_to_edge:
      return gpu::Wrap::clamp_to_edge;
    case Wrap::mirrored_repeat:
      return gpu::Wrap::mirrored_repeat;
    case Wrap::repeat:
      break;
  }
  return gpu::Wrap::repeat;
}

/// Slots of shaders/common/surface_material.glsl, in the order of TextureUse.
constexpr std::array<int, kDeviceTextureUses> kTextureSlots = {1, 3, 4, 5, 6, 7, 8};

/// Instead of its sheen, a surface has a base colour of the reflectance of both for uniform light: what is added, and
/// what the sheen leaves.
Eigen::Vector4f sheen_of(const Material& material) {
  const BsdfParams bsdf = bsdf_params_of(material.base_color.array(), material);
  if (!bsdf.has_sheen()) return {0, 0, 0, 1};
  const Eigen::Array3f reflected = bsdf.sheen * sheen_albedo_evenly(bsdf.sheen_alpha);
  return {reflected[0], reflected[1], reflected[2], under_sheen_evenly(bsdf)};
}

shader::DrawParams params_of(const StoredModel::Mesh::Part& part, const MaterialOverride& material,
                             float white_radiance, int number, int glass, const shader::DrawParams& view) {
  const Material combined = material.over(part.material);
  const bool own_color = !material.base_color, both = part.texture(TextureUse::metallic_roughness).texture;
  const bool rough_map = both && !material.roughness, metal_map = both && !material.metallic;
  const auto counts = [&](TextureUse use, const std::optional<float>& replaced) {
    return part.texture(use).texture && !replaced;
  };
  const bool passing_map = counts(TextureUse::transmission, material.transmission),
             coat_map = counts(TextureUse::clearcoat, material.clearcoat),
             coat_rough_map = counts(TextureUse::clearcoat_roughness, material.clearcoat_roughness);
  const auto flag = [](bool set) { return set ? 1.0f : 0.0f; };
  shader::DrawParams p = view;
  p.base_color << combined.base_color, flag(part.texture(TextureUse::base_color).texture && own_color);
  const bool transmits = glass > 0 && combined.transmission > 0 && combined.metallic < 1;
  p.tint << flag(own_color), (transmits ? static_cast<float>(glass) : 0.0f),
      (passing_map ? part.transmission_factor : combined.transmission), (combined.unlit ? white_radiance : 0.0f);
  p.material << (rough_map ? part.roughness_factor : combined.roughness),
      (metal_map ? part.metallic_factor : combined.metallic),
      (transmits ? combined.specular : combined.layer_specular()), static_cast<float>(number + 1);
  p.maps << flag(rough_map), flag(metal_map), (part.texture(TextureUse::normals).texture ? part.normal_scale : 0.0f),
      flag(combined.gltf);
  p.emission << white_radiance * combined.emission,
      flag(part.texture(TextureUse::emission).texture && !material.emission);
  p.coat << (coat_map ? part.clearcoat_factor : combined.clearcoat),
      (coat_rough_map ? part.clearcoat_roughness_factor : combined.clearcoat_roughness),
      combined.anisotropy * combined.anisotropy, 0;
  p.sheen = sheen_of(combined);
  const std::array<bool, kDeviceTextureUses> counted = {false,       false,    false,         false,
                                                        passing_map, coat_map, coat_rough_map};
  for (std::size_t use = 0; use < kDeviceTextureUses; ++use) {
    const Model::TextureSlot& slot = part.textures[use].slot;
    p.texture_rows[2 * use] << slot.transform.row(0).transpose(), static_cast<float>(slot.texcoord_set);
    p.texture_rows[2 * use + 1] << slot.transform.row(1).transpose(), flag(counted[use]);
  }
  return p;
}

}  // namespace

void ObjectDraws::add(const StoredModel::Mesh& mesh, const Eigen::Affine3f& T_tag_model,
                      const MaterialOverride& material, float white_radiance, int number,
                      const shader::DrawParams& view, const gpu::Texture& white, int glass) {
  for (const auto& part : mesh.parts) {
    if (part.index_count == 0) continue;
    shader::DrawParams& p = params.emplace_back(params_of(part, material, white_radiance, number, glass, view));
    p.T_tag_model = T_tag_model.matrix();
    gpu::DrawCall& call = calls.emplace_back();
    for (std::size_t use = 0; use < kDeviceTextureUses; ++use) {
      const auto& [texture, slot] = part.textures[use];
      call.bindings.push_back(gpu::sampled(kTextureSlots[use], texture ? *texture : white,
                                           gpu::Filter::linear_mip_linear, wrap_of(slot.wrap_u), wrap_of(slot.wrap_v)));
    }
    call.params = gpu::bytes_of(p);
    call.vertices = mesh.vertices.get();
    call.indices = part.indices.get();
    call.index_count = part.index_count;
  }
}

}  // namespace lumigraft::relight
