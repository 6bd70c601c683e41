#include "relight/exhibit/model_materials.h"

#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include "capture/error.h"
#include "relight/exhibit/picture_decode.h"

namespace lumigraft::relight {
namespace {

namespace fs = std::filesystem;

}  // namespace

ModelMaterials::ModelMaterials(const aiScene& scene, const fs::path& file, AssimpFormat format)
    : scene_(scene), file_(file), format_(format) {}

ModelMaterial ModelMaterials::read(unsigned index, bool has_vertex_colors) {
  ModelMaterial out;
  const aiMaterial& source = *scene_.mMaterials[index];
  read_base_color_texture(source, &out);
  if (format_ == AssimpFormat::obj)
    read_obj(source, has_vertex_colors, &out);
  else if (out.part.base_color_texture.picture || has_vertex_colors)
    out.part.material.base_color.setOnes();
  return out;
}

void ModelMaterials::read_obj(const aiMaterial& source, bool has_vertex_colors, ModelMaterial* out) {
  Material& material = out->part.material;
  const bool textured = out->part.base_color_texture.picture != nullptr;
  aiString name;
  source.Get(AI_MATKEY_NAME, name);
  const bool has_material = std::strcmp(name.C_Str(), AI_DEFAULT_MATERIAL_NAME) != 0;
  if (textured || (!has_material && has_vertex_colors)) material.base_color.setOnes();
  if (!has_material) return;

  aiColor3D diffuse(0.8f, 0.8f, 0.8f), specular(0, 0, 0);
  source.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse);
  source.Get(AI_MATKEY_COLOR_SPECULAR, specular);
  if (!textured) material.base_color = {diffuse.r, diffuse.g, diffuse.b};
  material.specular = std::clamp((specular.r + specular.g + specular.b) / 3.0f / 0.04f, 0.0f, 1.0f);
  source.Get(AI_MATKEY_METALLIC_FACTOR, material.metallic);
  float exponent = 0.0f;
  source.Get(AI_MATKEY_SHININESS, exponent);
  if (source.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness) != AI_SUCCESS) {
    material.roughness = std::pow(2.0f / (std::max(exponent, 0.0f) + 2.0f), 0.25f);
  }
  material.metallic = std::clamp(material.metallic, 0.0f, 1.0f);
  material.roughness = std::clamp(material.roughness, 0.0f, 1.0f);
}

void ModelMaterials::read_base_color_texture(const aiMaterial& source, ModelMaterial* out) {
  aiString reference;
  if (source.GetTexture(aiTextureType_DIFFUSE, 0, &reference) != AI_SUCCESS || reference.length == 0) return;
  int channel = 0;
  source.Get(AI_MATKEY_UVWSRC(aiTextureType_DIFFUSE, 0), channel);
  TexturePicture& picture = pictures_[reference.C_Str()];
  if (!picture) picture = decode(reference.C_Str());
  out->part.base_color_texture.picture = picture;
  out->texcoord_channel = static_cast<unsigned>(std::max(channel, 0));
}

TexturePicture ModelMaterials::decode(const std::string& reference) const {
  std::string relative = reference;
  std::replace(relative.begin(), relative.end(), '\\', '/');
  const fs::path path = file_.parent_path() / relative;
  return capture::with_error_context(file_.string() + ": texture \"" + reference.substr(0, 200) + "\"", [&] {
    capture::refuse_if(!fs::is_regular_file(path), "no such file");
    std::ifstream in(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
    return decode_picture(bytes);
  });
}

}  // namespace lumigraft::relight
