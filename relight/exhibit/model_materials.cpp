#include "relight/exhibit/model_materials.h"

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/error.h"

namespace lumigraft::relight {
namespace {

namespace fs = std::filesystem;

constexpr float kMaxNormalScale = 100;  // beyond it any normal that is not exactly upright lies in the surface

capture::Image<std::uint8_t> to_rgb(const cv::Mat& bgr) {
  capture::Image<std::uint8_t> image(bgr.cols, bgr.rows, 3);
  cv::cvtColor(bgr, cv::Mat(bgr.rows, bgr.cols, CV_8UC3, image.data.data()), cv::COLOR_BGR2RGB);
  return image;
}

/// Of a channel, from 0 to 1.
float mean_of(const capture::Image<std::uint8_t>& picture, std::size_t channel) {
  std::uint64_t sum = 0;
  for (std::size_t i = channel; i < picture.data.size(); i += 3) sum += picture.data[i];
  return static_cast<float>(static_cast<double>(sum) / (255.0 * picture.width * picture.height));
}

// References in glTF are URIs: %20 is a space.
std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool escape = uri[i] == '%' && i + 2 < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
                        std::isxdigit(static_cast<unsigned char>(uri[i + 2]));
    if (escape) {
      text += static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

}  // namespace

ModelMaterials::ModelMaterials(const aiScene& scene, const fs::path& file, ModelFormat format)
    : scene_(scene), file_(file), format_(format) {
  if (format == ModelFormat::gltf) gltf_ = read_gltf_extras(file);
}

ModelMaterial ModelMaterials::read(unsigned index, bool has_vertex_colors) {
  ModelMaterial out;
  const aiMaterial& source = *scene_.mMaterials[index];
  switch (format_) {
    case ModelFormat::gltf:
      read_gltf(source, index, &out);
      break;
    case ModelFormat::obj:
      read_obj(source, has_vertex_colors, &out);
      break;
    case ModelFormat::ply:
      read_base_color_texture(source, aiTextureType_DIFFUSE, &out);
      if (out.part.base_color_texture || has_vertex_colors) out.part.material.base_color.setOnes();
      break;
  }
  return out;
}

void ModelMaterials::read_gltf(const aiMaterial& source, unsigned index, ModelMaterial* out) {
  Model::Part& part = out->part;
  aiColor4D base(1, 1, 1, 1);
  source.Get(AI_MATKEY_BASE_COLOR, base);
  part.material.base_color = {base.r, base.g, base.b};
  source.Get(AI_MATKEY_METALLIC_FACTOR, part.metallic_factor);
  source.Get(AI_MATKEY_ROUGHNESS_FACTOR, part.roughness_factor);
  part.metallic_factor = std::clamp(part.metallic_factor, 0.0f, 1.0f);
  part.roughness_factor = std::clamp(part.roughness_factor, 0.0f, 1.0f);
  part.material.metallic = part.metallic_factor;
  part.material.roughness = part.roughness_factor;
  part.material.gltf = true;
  if (index < gltf_.specular.size()) part.material.specular = gltf_.specular[index];
  read_base_color_texture(source, aiTextureType_BASE_COLOR, out);
  bool channel_is_set = part.base_color_texture != nullptr;
  const auto has_same_texcoords = [&](const Texture& texture) {
    if (!channel_is_set) out->texcoord_channel = texture.texcoord_channel;
    channel_is_set = true;
    return texture.texcoord_channel == out->texcoord_channel;
  };
  // assimp classifies the texture of both as "unknown".
  if (const Texture both = texture(source, aiTextureType_UNKNOWN); both.picture) {
    part.material.roughness *= mean_of(*both.picture, 1);
    part.material.metallic *= mean_of(*both.picture, 2);
    if (has_same_texcoords(both)) part.metallic_roughness_texture = both.picture;
  }
  if (const Texture normals = texture(source, aiTextureType_NORMALS); normals.picture && has_same_texcoords(normals)) {
    part.normal_texture = normals.picture;
    source.Get(AI_MATKEY_GLTF_TEXTURE_SCALE(aiTextureType_NORMALS, 0), part.normal_scale);
    part.normal_scale = std::clamp(part.normal_scale, -kMaxNormalScale, kMaxNormalScale);
  }
}

void ModelMaterials::read_obj(const aiMaterial& source, bool has_vertex_colors, ModelMaterial* out) {
  Material& material = out->part.material;
  read_base_color_texture(source, aiTextureType_DIFFUSE, out);
  const bool textured = out->part.base_color_texture != nullptr;
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

void ModelMaterials::read_base_color_texture(const aiMaterial& source, int type, ModelMaterial* out) {
  const Texture found = texture(source, type);
  out->part.base_color_texture = found.picture;
  out->texcoord_channel = found.texcoord_channel;
}

ModelMaterials::Texture ModelMaterials::texture(const aiMaterial& source, int type) {
  aiString reference;
  const auto texture_type = static_cast<aiTextureType>(type);
  if (source.GetTexture(texture_type, 0, &reference) != AI_SUCCESS || reference.length == 0) return {};
  int channel = 0;
  source.Get(AI_MATKEY_UVWSRC(texture_type, 0), channel);
  TexturePicture& picture = pictures_[reference.C_Str()];
  if (!picture) picture = decode(reference.C_Str());
  return {picture, static_cast<unsigned>(std::max(channel, 0))};
}

TexturePicture ModelMaterials::decode(const std::string& reference) const {
  const auto fail = [&](const std::string& why) {
    throw capture::InputError(file_.string() + ": texture \"" + reference.substr(0, 200) + "\": " + why);
  };
  std::vector<std::uint8_t> bytes;
  if (const aiTexture* embedded = scene_.GetEmbeddedTexture(reference.c_str())) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(embedded->pcData);
    if (embedded->mHeight != 0) fail("found raw texels, allowed: PNG or JPEG");
    bytes.assign(data, data + embedded->mWidth);
  } else {
    std::string relative = reference;
    std::replace(relative.begin(), relative.end(), '\\', '/');
    fs::path path = file_.parent_path() / relative;
    if (!fs::is_regular_file(path)) path = file_.parent_path() / percent_decoded(relative);
    if (!fs::is_regular_file(path)) fail("no such file");
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  cv::Mat picture;
  try {
    if (!bytes.empty()) picture = cv::imdecode(bytes, cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) fail("not a picture that can be read");
  return std::make_shared<capture::Image<std::uint8_t>>(to_rgb(picture));
}

}  // namespace lumigraft::relight
