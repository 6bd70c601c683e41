#include "relight/exhibit/model_materials.h"

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

capture::Image<std::uint8_t> to_rgb(const cv::Mat& bgr) {
  capture::Image<std::uint8_t> image(bgr.cols, bgr.rows, 3);
  cv::cvtColor(bgr, cv::Mat(bgr.rows, bgr.cols, CV_8UC3, image.data.data()), cv::COLOR_BGR2RGB);
  return image;
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
  if (format == ModelFormat::gltf) gltf_specular_ = gltf_specular_factors(file);
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
      out.base_color_texture = texture(source, aiTextureType_DIFFUSE, &out.texcoord_channel);
      if (out.base_color_texture || has_vertex_colors) out.material.base_color.setOnes();
      break;
  }
  return out;
}

void ModelMaterials::read_gltf(const aiMaterial& source, unsigned index, ModelMaterial* out) {
  Material& material = out->material;
  aiColor4D base(1, 1, 1, 1);
  source.Get(AI_MATKEY_BASE_COLOR, base);
  material.base_color = {base.r, base.g, base.b};
  material.metallic = 1.0f;  // the defaults of glTF
  material.roughness = 1.0f;
  source.Get(AI_MATKEY_METALLIC_FACTOR, material.metallic);
  source.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness);
  // One texture has both: roughness in green, metallic in blue. assimp classifies it as "unknown".
  material.roughness *= texture_mean(source, aiTextureType_UNKNOWN, 1);
  material.metallic *= texture_mean(source, aiTextureType_UNKNOWN, 2);
  if (index < gltf_specular_.size()) material.specular = gltf_specular_[index];
  out->base_color_texture = texture(source, aiTextureType_BASE_COLOR, &out->texcoord_channel);
}

void ModelMaterials::read_obj(const aiMaterial& source, bool has_vertex_colors, ModelMaterial* out) {
  Material& material = out->material;
  out->base_color_texture = texture(source, aiTextureType_DIFFUSE, &out->texcoord_channel);
  aiString name;
  source.Get(AI_MATKEY_NAME, name);
  const bool has_material = std::strcmp(name.C_Str(), AI_DEFAULT_MATERIAL_NAME) != 0;
  if (out->base_color_texture || (!has_material && has_vertex_colors)) material.base_color.setOnes();
  if (!has_material) return;

  aiColor3D diffuse(0.8f, 0.8f, 0.8f), specular(0, 0, 0);
  source.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse);
  source.Get(AI_MATKEY_COLOR_SPECULAR, specular);
  if (!out->base_color_texture) material.base_color = {diffuse.r, diffuse.g, diffuse.b};
  material.specular = std::clamp((specular.r + specular.g + specular.b) / 3.0f / 0.04f, 0.0f, 1.0f);
  source.Get(AI_MATKEY_METALLIC_FACTOR, material.metallic);
  float exponent = 0.0f;
  source.Get(AI_MATKEY_SHININESS, exponent);
  if (source.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness) != AI_SUCCESS) {
    material.roughness = std::pow(2.0f / (std::max(exponent, 0.0f) + 2.0f), 0.25f);
  }
}

ModelMaterials::Picture ModelMaterials::texture(const aiMaterial& source, int type, unsigned* texcoord_channel) {
  aiString reference;
  const auto texture_type = static_cast<aiTextureType>(type);
  if (source.GetTexture(texture_type, 0, &reference) != AI_SUCCESS || reference.length == 0) return nullptr;
  int channel = 0;
  source.Get(AI_MATKEY_UVWSRC(texture_type, 0), channel);
  *texcoord_channel = static_cast<unsigned>(std::max(channel, 0));
  Picture& picture = pictures_[reference.C_Str()];
  if (!picture) picture = decode(reference.C_Str());
  return picture;
}

float ModelMaterials::texture_mean(const aiMaterial& source, int type, int channel) {
  unsigned texcoord_channel = 0;
  const Picture picture = texture(source, type, &texcoord_channel);
  if (!picture) return 1.0f;
  std::uint64_t sum = 0;
  for (std::size_t i = channel; i < picture->data.size(); i += 3) sum += picture->data[i];
  return static_cast<float>(static_cast<double>(sum) / (255.0 * picture->width * picture->height));
}

ModelMaterials::Picture ModelMaterials::decode(const std::string& reference) const {
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
