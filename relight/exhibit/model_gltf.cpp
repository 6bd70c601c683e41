// Reads glTF data that assimp 5.2 ignores.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "relight/exhibit/model_materials.h"

namespace lumigraft::relight {
namespace {

using nlohmann::json;

constexpr int kRepeat = 10497;  // of a sampler's wrapS and wrapT
constexpr std::size_t kMaxNameCharacters = 60, kMaxFeatures = 8;

/// The JSON part of a file: all of a .gltf; the first chunk of a .glb (12 bytes of header, then length, type, data).
std::string json_part(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 20> head{};
  in.read(head.data(), head.size());
  if (in.gcount() == static_cast<std::streamsize>(head.size()) && std::memcmp(head.data(), "glTF", 4) == 0) {
    std::uint32_t length = 0;
    std::memcpy(&length, head.data() + 12, 4);
    std::string text(std::min<std::uintmax_t>(length, std::filesystem::file_size(file)), ' ');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    return text;
  }
  in.clear();
  in.seekg(0);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Null where there is none.
const json& member(const json& object, const char* key) {
  static const json none;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? *found : none;
}

const json& element(const json& array, const json& index) {
  static const json none;
  const bool valid = array.is_array() && index.is_number_unsigned() && index.get<std::size_t>() < array.size();
  return valid ? array[index.get<std::size_t>()] : none;
}

std::uint64_t number_or(const json& value, std::uint64_t otherwise) {
  return value.is_number_unsigned() ? value.get<std::uint64_t>() : otherwise;
}

std::string name_of(const json& material, std::size_t index) {
  const json& name = member(material, "name");
  std::string text = name.is_string() ? name.get<std::string>().substr(0, kMaxNameCharacters) : std::string();
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c); }, ' ');
  return "material " + (text.empty() ? std::to_string(index) : "\"" + text + "\"");
}

/// Materials in the order in which assimp 5.2 numbers them: of first use, children of a node before its mesh.
class MaterialOrder {
 public:
  explicit MaterialOrder(const json& root) : root_(root) {
    const json& scene = element(member(root, "scenes"), json(number_or(member(root, "scene"), 0)));
    for (const json& node : member(scene, "nodes")) visit(node);
  }
  const std::vector<std::size_t>& indices() const { return order_; }  ///< into the file's materials

 private:
  void visit(const json& index) {
    const json& node = element(member(root_, "nodes"), index);
    if (node.is_null() || !nodes_.insert(index.get<std::size_t>()).second) return;
    for (const json& child : member(node, "children")) visit(child);
    for (const json& primitive : member(element(member(root_, "meshes"), member(node, "mesh")), "primitives")) {
      const json& material = member(primitive, "material");
      if (element(member(root_, "materials"), material).is_null()) continue;
      if (materials_.insert(material.get<std::size_t>()).second) order_.push_back(material.get<std::size_t>());
    }
  }

  const json& root_;
  std::set<std::size_t> nodes_, materials_;
  std::vector<std::size_t> order_;
};

/// Whether a texture has a sampler that does not repeat it.
bool is_clamped(const json& root, const json& texture) {
  const json& sampler = element(member(root, "samplers"), member(texture, "sampler"));
  return number_or(member(sampler, "wrapS"), kRepeat) != kRepeat ||
         number_or(member(sampler, "wrapT"), kRepeat) != kRepeat;
}

bool emits(const json& material) {
  const json& factor = member(material, "emissiveFactor");
  return factor.is_array() && std::any_of(factor.begin(), factor.end(), [](const json& channel) {
           return channel.is_number() && channel.get<double>() > 0;
         });
}

/// Whether KHR_materials_specular has more than a factor.
bool has_specular_colors(const json& extension) {
  for (const char* key : {"specularTexture", "specularColorTexture"}) {
    if (!member(extension, key).is_null()) return true;
  }
  const json& color = member(extension, "specularColorFactor");
  return !color.is_null() && color != json::array({1, 1, 1});
}

/// What a material asks for and is not drawn.
std::vector<std::string> not_drawn_of(const json& root, const json& material) {
  std::vector<std::string> features;
  const json& alpha = member(material, "alphaMode");
  if (alpha == "BLEND" || alpha == "MASK") features.push_back("alphaMode " + alpha.get<std::string>());
  if (emits(material)) features.emplace_back("emission");
  const json &base = member(member(material, "pbrMetallicRoughness"), "baseColorTexture"),
             &both = member(member(material, "pbrMetallicRoughness"), "metallicRoughnessTexture"),
             &normal = member(material, "normalTexture");
  std::set<std::string> texcoords;
  bool clamped = false;
  for (const json* info : {&base, &both, &normal}) {
    if (info->is_null()) continue;
    texcoords.insert(std::to_string(number_or(member(*info, "texCoord"), 0)) +
                     member(member(*info, "extensions"), "KHR_texture_transform").dump());
    const json& texture = element(member(root, "textures"), member(*info, "index"));
    clamped |= is_clamped(root, texture);
    if (!member(texture, "source").is_null() || !member(texture, "extensions").is_object()) continue;
    for (const auto& [name, content] : member(texture, "extensions").items()) features.push_back(name);
  }
  if (texcoords.size() > 1) features.emplace_back("different texture coordinates for its textures");
  if (clamped) features.emplace_back("wrap modes other than repeat");
  const json& extensions = member(material, "extensions");
  if (!extensions.is_object()) return features;
  for (const auto& [name, content] : extensions.items()) {
    if (name != "KHR_materials_specular" || has_specular_colors(content)) features.push_back(name);
  }
  return features;
}

std::vector<std::string> not_drawn(const json& root, const std::vector<std::size_t>& used) {
  struct Users {
    std::string first;
    std::size_t others = 0;
  };
  std::map<std::string, Users> features;
  const json& materials = member(root, "materials");
  for (const std::size_t i : used) {
    for (const std::string& feature : not_drawn_of(root, materials[i])) {
      const auto [users, is_new] = features.try_emplace(feature, Users{name_of(materials[i], i)});
      if (!is_new) ++users->second.others;
    }
  }
  std::vector<std::string> lines;
  for (const auto& [feature, users] : features) {
    lines.push_back(feature.substr(0, kMaxNameCharacters) + " (" + users.first +
                    (users.others ? " and " + std::to_string(users.others) + " more" : std::string()) + ")");
  }
  std::set<std::string> of_scene;
  for (const json& node : member(root, "nodes")) {
    const json& extensions = member(node, "extensions");
    if (!extensions.is_object()) continue;
    for (const auto& [name, content] : extensions.items()) of_scene.insert(name.substr(0, kMaxNameCharacters));
  }
  for (const json& mesh : member(root, "meshes")) {
    for (const json& primitive : member(mesh, "primitives")) {
      if (!member(primitive, "targets").is_null()) of_scene.insert("morph targets");
    }
  }
  for (const char* motion : {"animations", "skins"}) {
    if (const json& all = member(root, motion); all.is_array() && !all.empty()) of_scene.insert(motion);
  }
  lines.insert(lines.end(), of_scene.begin(), of_scene.end());
  if (lines.size() > kMaxFeatures) {
    const std::size_t more = lines.size() - kMaxFeatures;
    lines.resize(kMaxFeatures);
    lines.push_back(std::to_string(more) + " more features");
  }
  return lines;
}

/// Without what is large and not read here.
json parsed(const std::string& text) {
  const auto wanted = [](int depth, json::parse_event_t event, json& key) {
    return depth != 1 || event != json::parse_event_t::key ||
           (key != "buffers" && key != "images" && key != "accessors" && key != "bufferViews");
  };
  return json::parse(text, wanted, /*allow_exceptions=*/false);
}

}  // namespace

GltfExtras read_gltf_extras(const std::filesystem::path& file) {
  const json root = parsed(json_part(file));
  GltfExtras extras;
  if (!root.is_object()) return extras;
  const MaterialOrder order(root);
  extras.not_drawn = not_drawn(root, order.indices());
  for (const std::size_t i : order.indices()) {
    const json& specular = member(member(member(root, "materials")[i], "extensions"), "KHR_materials_specular");
    const json& factor = member(specular, "specularFactor");
    extras.specular.push_back(factor.is_number() ? std::clamp(factor.get<float>(), 0.0f, 1.0f) : 1.0f);
  }
  return extras;
}

}  // namespace lumigraft::relight
