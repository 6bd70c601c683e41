#include "relight/exhibit/gltf/not_drawn.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "relight/exhibit/gltf/materials.h"
#include "relight/exhibit/gltf/parameters.h"
#include "relight/exhibit/gltf/primitive.h"

namespace lumigraft::relight {
namespace {

constexpr std::size_t kMaxNameCharacters = 60, kMaxFeatures = 8;

std::string printable(std::string text) {
  text.resize(std::min(text.size(), kMaxNameCharacters));
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c); }, ' ');
  return text;
}

std::string name_of(const GltfValue& material, std::size_t index) {
  const std::string name = printable(material.text("name", ""));
  return "material " + (name.empty() ? std::to_string(index) : "\"" + name + "\"");
}

void add_of_texture(const GltfTextures& textures, const GltfValue& info, std::vector<std::string>& features) {
  if (!info.exists()) return;
  const std::size_t set = GltfTextures::texcoord_set(info);
  if (set > 1) features.push_back("TEXCOORD_" + std::to_string(set));
  const GltfValue texture = textures.texture(info);
  if (GltfTextures::image_of(texture).exists()) return;
  for (const std::string& name : texture.member("extensions").keys()) features.push_back(name);
}

std::vector<std::string> of_material(const GltfTextures& textures, const GltfValue& material) {
  std::vector<std::string> features;
  const GltfValue pbr = material.member("pbrMetallicRoughness");
  if (is_unlit(material)) {
    add_of_texture(textures, pbr.member("baseColorTexture"), features);
    return features;
  }
  const auto emission = material.numbers("emissiveFactor", 3, -kAnyNumber, kAnyNumber);
  if (material.flag("doubleSided", false) && emission && *std::max_element(emission->begin(), emission->end()) > 0)
    features.emplace_back("emission of the back");
  const GltfValue coat = material.extension("KHR_materials_clearcoat"),
                  specular = material.extension("KHR_materials_specular"),
                  sheen = material.extension("KHR_materials_sheen");
  for (const GltfValue& info :
       {pbr.member("baseColorTexture"), pbr.member("metallicRoughnessTexture"), material.member("normalTexture"),
        material.member("emissiveTexture"),
        material.extension("KHR_materials_transmission").member("transmissionTexture"), coat.member("clearcoatTexture"),
        coat.member("clearcoatRoughnessTexture"), coat.member("clearcoatNormalTexture"),
        specular.member("specularTexture"), specular.member("specularColorTexture"), sheen.member("sheenColorTexture"),
        sheen.member("sheenRoughnessTexture"),
        material.extension("KHR_materials_anisotropy").member("anisotropyTexture")}) {
    add_of_texture(textures, info, features);
  }
  for (const std::string& name : material.member("extensions").keys()) {
    if (!is_read_of_gltf(name) || (name == "KHR_materials_ior" && reflects_totally(material))) features.push_back(name);
  }
  return features;
}

/// The first material, and how many more there are.
struct Users {
  std::string first;
  std::size_t others = 0;

  std::string text() const { return first + (others ? " and " + std::to_string(others) + " more" : std::string()); }
};

std::vector<std::string> of_materials(const GltfDocument& document, const GltfTextures& textures,
                                      const std::set<std::size_t>& used) {
  std::map<std::string, Users> features;
  const GltfValue materials = document.root().member("materials");
  for (const std::size_t i : used) {
    std::vector<std::string> all = of_material(textures, materials[i]);
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (const std::string& feature : all) {
      const auto [users, is_new] = features.try_emplace(feature, Users{name_of(materials[i], i)});
      if (!is_new) ++users->second.others;
    }
  }
  std::vector<std::string> lines;
  for (const auto& [feature, users] : features) lines.push_back(printable(feature) + " (" + users.text() + ")");
  return lines;
}

std::set<std::string> of_scene(const GltfValue& root) {
  std::set<std::string> features;
  const auto add_extensions = [&](const GltfValue& of) {
    for (const std::string& name : of.member("extensions").keys()) {
      if (!is_read_of_gltf(name)) features.insert(printable(name));
    }
  };
  add_extensions(root);
  const GltfValue nodes = root.member("nodes"), meshes = root.member("meshes");
  for (std::size_t i = 0; i < nodes.size(); ++i) add_extensions(nodes[i]);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const GltfValue primitives = meshes[i].member("primitives");
    for (std::size_t k = 0; k < primitives.size(); ++k) {
      add_extensions(primitives[k]);
      if (!has_triangles(primitives[k])) features.insert("points and lines");
    }
  }
  const GltfValue animations = root.member("animations");
  for (std::size_t i = 0; i < animations.size(); ++i) {
    const GltfValue channels = animations[i].member("channels");
    for (std::size_t k = 0; k < channels.size(); ++k) add_extensions(channels[k].member("target"));
  }
  if (root.member("cameras").size() > 0) features.insert("cameras");
  return features;
}

}  // namespace

std::vector<std::string> gltf_not_drawn(const GltfDocument& document, const GltfTextures& textures,
                                        const std::set<std::size_t>& materials) {
  std::vector<std::string> lines;
  if (const std::size_t pictures = textures.scaled_down(); pictures > 0) {
    lines.push_back("the full size of " + std::to_string(pictures) + (pictures == 1 ? " picture" : " pictures") +
                    " (scaled down to at most " + std::to_string(textures.max_texels()) + " pixels each)");
  }
  const std::vector<std::string> of_all = of_materials(document, textures, materials);
  lines.insert(lines.end(), of_all.begin(), of_all.end());
  const std::set<std::string> scene = of_scene(document.root());
  lines.insert(lines.end(), scene.begin(), scene.end());
  if (lines.size() > kMaxFeatures) {
    const std::size_t more = lines.size() - kMaxFeatures;
    lines.resize(kMaxFeatures);
    lines.push_back(std::to_string(more) + " more features");
  }
  return lines;
}

std::string gltf_blended(const GltfDocument& document, const std::set<std::size_t>& materials) {
  const GltfValue all = document.root().member("materials");
  Users users;
  for (const std::size_t i : materials) {
    if (users.first.empty())
      users.first = name_of(all[i], i);
    else
      ++users.others;
  }
  return users.text();
}

}  // namespace lumigraft::relight
