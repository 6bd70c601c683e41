#include "relight/exhibit/gltf/materials.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "capture/camera/srgb.h"
#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

/// Exporters write factors that rounding has brought beyond 0 to 1.
double unit_number(const GltfValue& value, const char* key, double otherwise) {
  return std::clamp(value.number(key, -kAnyNumber, kAnyNumber, otherwise), 0.0, 1.0);
}

Eigen::Vector3f unit_color(const GltfValue& value, const char* key, std::size_t count, float otherwise) {
  const auto color = value.numbers(key, count, -kAnyNumber, kAnyNumber);
  if (!color) return Eigen::Vector3f::Constant(otherwise);
  return Eigen::Vector3d((*color)[0], (*color)[1], (*color)[2]).cwiseMax(0).cwiseMin(1).cast<float>();
}

float transmission_of(const GltfValue& material) {
  return static_cast<float>(unit_number(material.extension("KHR_materials_transmission"), "transmissionFactor", 0));
}

/// Without KHR_materials_volume, or with the thickness 0, a transmissive material is that of a sheet. A texture of the
/// thickness is for renderers that do not trace the volume.
void read_volume(const GltfValue& material, Material* read) {
  const GltfValue volume = material.extension("KHR_materials_volume");
  read->thin_walled = read->transmission > 0 && !(volume.number("thicknessFactor", 0, kAnyNumber, 0) > 0);
  read->attenuation_color = unit_color(volume, "attenuationColor", 3, 1);
  const double distance_m = volume.number("attenuationDistance", 0, kAnyNumber, 0);
  if (!volume.member("attenuationDistance").exists()) return;
  if (!(distance_m > 0)) volume.member("attenuationDistance").refuse("a number above 0");
  read->attenuation_distance_m = static_cast<float>(distance_m);
}

/// Of a channel, from 0 to 1.
float mean_of(const capture::Image<std::uint8_t>& picture, std::size_t channel) {
  std::uint64_t sum = 0;
  for (std::size_t i = channel; i < picture.data.size(); i += 3) sum += picture.data[i];
  return static_cast<float>(static_cast<double>(sum) / (255.0 * picture.width * picture.height));
}

float normal_scale_of(const GltfValue& texture_info) {
  return std::clamp(static_cast<float>(texture_info.number("scale", -1e30, 1e30, 1)), -kGltf.max_normal_scale,
                    kGltf.max_normal_scale);
}

/// In linear light, of an sRGB picture.
Eigen::Vector3f mean_color(const capture::Image<std::uint8_t>& picture) {
  const auto& linear = capture::srgb_table().linear;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < picture.data.size(); i += 3) {
    for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(linear[picture.data[i + static_cast<std::size_t>(c)]]);
  }
  return (sum * (3.0 / static_cast<double>(picture.data.size()))).cast<float>();
}

void read_clearcoat(const GltfValue& coat, GltfTextures& textures, Model::Part* part) {
  Material& read = part->material;
  part->clearcoat_factor = read.clearcoat = static_cast<float>(unit_number(coat, "clearcoatFactor", 0));
  if (!(read.clearcoat > 0)) return;
  part->clearcoat_roughness_factor = read.clearcoat_roughness =
      static_cast<float>(unit_number(coat, "clearcoatRoughnessFactor", 0));
  part->clearcoat_texture = textures.slot(coat.member("clearcoatTexture"));
  part->clearcoat_roughness_texture = textures.slot(coat.member("clearcoatRoughnessTexture"));
  if (const TexturePicture& picture = part->clearcoat_texture.picture) read.clearcoat *= mean_of(*picture, 0);
  if (const TexturePicture& picture = part->clearcoat_roughness_texture.picture)
    read.clearcoat_roughness *= mean_of(*picture, 1);
  const GltfValue normal = coat.member("clearcoatNormalTexture");
  part->clearcoat_normal_texture = textures.slot(normal);
  part->clearcoat_normal_scale = normal_scale_of(normal);
}

/// The index 0, of total reflection, is read as 1.5.
float ior_of(const GltfValue& material) {
  const GltfValue extension = material.extension("KHR_materials_ior");
  const double ior = extension.number("ior", 0, kAnyNumber, 1.5);
  if (ior > 0 && ior < 1) extension.member("ior").refuse("0, or at least 1");
  return reflects_totally(material) ? 1.5f : static_cast<float>(std::min(ior, kMaxIor));
}

void read_specular(const GltfValue& specular, GltfTextures& textures, Model::Part* part) {
  Material& read = part->material;
  part->specular_factor = read.specular = static_cast<float>(unit_number(specular, "specularFactor", 1));
  if (const auto color = specular.numbers("specularColorFactor", 3, -kAnyNumber, kAnyNumber)) {
    read.specular_color =
        Eigen::Vector3d((*color)[0], (*color)[1], (*color)[2]).cwiseMax(0).cwiseMin(kMaxSpecularColor).cast<float>();
  }
  part->specular_color_factor = read.specular_color;
  part->specular_texture = textures.slot_of_alpha(specular.member("specularTexture"));
  part->specular_color_texture = textures.slot(specular.member("specularColorTexture"));
  if (const TexturePicture& picture = part->specular_texture.picture) read.specular *= mean_of(*picture, 0);
  if (const TexturePicture& picture = part->specular_color_texture.picture)
    read.specular_color.array() *= mean_color(*picture).array();
}

void read_sheen(const GltfValue& sheen, GltfTextures& textures, Model::Part* part) {
  Material& read = part->material;
  part->sheen_color_factor = read.sheen_color = unit_color(sheen, "sheenColorFactor", 3, 0);
  if (!(read.sheen_color.maxCoeff() > 0)) return;
  part->sheen_roughness_factor = read.sheen_roughness =
      static_cast<float>(unit_number(sheen, "sheenRoughnessFactor", 0));
  part->sheen_color_texture = textures.slot(sheen.member("sheenColorTexture"));
  part->sheen_roughness_texture = textures.slot_of_alpha(sheen.member("sheenRoughnessTexture"));
  if (const TexturePicture& picture = part->sheen_color_texture.picture)
    read.sheen_color.array() *= mean_color(*picture).array();
  if (const TexturePicture& picture = part->sheen_roughness_texture.picture)
    read.sheen_roughness *= mean_of(*picture, 0);
}

void read_anisotropy(const GltfValue& anisotropy, GltfTextures& textures, Model::Part* part) {
  Material& read = part->material;
  part->anisotropy_factor = read.anisotropy = static_cast<float>(unit_number(anisotropy, "anisotropyStrength", 0));
  if (!(read.anisotropy > 0)) return;
  const double turns = std::numbers::pi * 2,
               rotation = anisotropy.number("anisotropyRotation", -kAnyNumber, kAnyNumber, 0);
  read.anisotropy_rotation_rad = static_cast<float>(std::fmod(rotation, turns));
  part->anisotropy_texture = textures.slot(anisotropy.member("anisotropyTexture"));
  if (const TexturePicture& picture = part->anisotropy_texture.picture) read.anisotropy *= mean_of(*picture, 2);
}

/// A material of which nothing is transparent is not blended.
void read_opacity(const GltfValue& material, const GltfValue& pbr, GltfTextures& textures, Model::Part* part) {
  if (material.text("alphaMode", "OPAQUE") != "BLEND") return;
  if (const auto factor = pbr.numbers("baseColorFactor", 4, -kAnyNumber, kAnyNumber))
    part->opacity_factor = static_cast<float>(std::clamp((*factor)[3], 0.0, 1.0));
  const Model::TextureSlot slot = textures.slot_of_alpha(pbr.member("baseColorTexture"));
  if (slot.picture && std::ranges::any_of(slot.picture->data, [](std::uint8_t a) { return a < 255; }))
    part->opacity_texture = slot;
}

}  // namespace

bool reflects_totally(const GltfValue& material) {
  return material.extension("KHR_materials_ior").number("ior", 0, kAnyNumber, 1.5) == 0;
}

std::optional<AlphaMask> read_alpha(const GltfValue& material, const Model::Part& part, GltfTextures& textures) {
  const std::string mode = material.text("alphaMode", "OPAQUE");
  if (mode == "OPAQUE") return std::nullopt;
  if (mode != "MASK" && mode != "BLEND") material.member("alphaMode").refuse("OPAQUE, MASK or BLEND");
  AlphaMask mask;
  if (mode == "MASK") mask.cutoff = static_cast<float>(material.number("alphaCutoff", 0, kAnyNumber, 0.5));
  const GltfValue pbr = material.member("pbrMetallicRoughness");
  const auto factor = pbr.numbers("baseColorFactor", 4, -kAnyNumber, kAnyNumber);
  if (factor) mask.factor = static_cast<float>(std::clamp((*factor)[3], 0.0, 1.0));
  mask.slot = part.base_color_texture;
  if (mask.slot.picture) mask.alpha = textures.alpha(pbr.member("baseColorTexture"));
  return mask;
}

bool is_unlit(const GltfValue& material) { return material.extension("KHR_materials_unlit").exists(); }

Model::Part read_material(const GltfValue& material, GltfTextures& textures) {
  Model::Part part;
  const GltfValue pbr = material.member("pbrMetallicRoughness");
  part.material.gltf = true;
  part.material.base_color = unit_color(pbr, "baseColorFactor", 4, 1);
  part.base_color_texture = textures.slot(pbr.member("baseColorTexture"));
  read_opacity(material, pbr, textures, &part);
  if (is_unlit(material)) {
    part.material.unlit = true;
    part.material.specular = 0;
    return part;
  }
  part.metallic_factor = static_cast<float>(unit_number(pbr, "metallicFactor", 1));
  part.roughness_factor = static_cast<float>(unit_number(pbr, "roughnessFactor", 1));
  part.material.metallic = part.metallic_factor;
  part.material.roughness = part.roughness_factor;
  read_specular(material.extension("KHR_materials_specular"), textures, &part);
  part.material.ior = ior_of(material);
  part.transmission_factor = part.material.transmission = transmission_of(material);
  read_volume(material, &part.material);
  const double strength = std::min(
      material.extension("KHR_materials_emissive_strength").number("emissiveStrength", 0, kAnyNumber, 1), kMaxEmission);
  part.material.emission = unit_color(material, "emissiveFactor", 3, 0) * static_cast<float>(strength);

  part.metallic_roughness_texture = textures.slot(pbr.member("metallicRoughnessTexture"));
  if (const TexturePicture& both = part.metallic_roughness_texture.picture) {
    part.material.roughness *= mean_of(*both, 1);
    part.material.metallic *= mean_of(*both, 2);
  }
  const GltfValue normal = material.member("normalTexture");
  part.normal_texture = textures.slot(normal);
  part.normal_scale = normal_scale_of(normal);
  // Black without the texture stays black with it, and opaque is opaque.
  if (!part.material.emission.isZero()) part.emissive_texture = textures.slot(material.member("emissiveTexture"));
  if (part.transmission_factor > 0) {
    part.transmission_texture =
        textures.slot(material.extension("KHR_materials_transmission").member("transmissionTexture"));
    if (const TexturePicture& picture = part.transmission_texture.picture)
      part.material.transmission *= mean_of(*picture, 0);
  }
  read_clearcoat(material.extension("KHR_materials_clearcoat"), textures, &part);
  read_sheen(material.extension("KHR_materials_sheen"), textures, &part);
  read_anisotropy(material.extension("KHR_materials_anisotropy"), textures, &part);
  return part;
}

}  // namespace lumigraft::relight
