// Reads glTF data that assimp 5.2 ignores.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "relight/exhibit/model_materials.h"

namespace lumigraft::relight {
namespace {

using nlohmann::json;

constexpr int kRepeat = 10497;  // of a sampler's wrapS and wrapT
constexpr std::size_t kMaxNameCharacters = 60;

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

/// Whether a texture has a sampler that does not repeat it.
bool is_clamped(const json& root, const json& texture_info) {
  const json& texture = element(member(root, "textures"), member(texture_info, "index"));
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

/// What a material asks for and is not drawn.
std::vector<std::string> not_drawn_of(const json& root, const json& material) {
  std::vector<std::string> features;
  const json& alpha = member(material, "alphaMode");
  if (alpha == "BLEND" || alpha == "MASK") features.push_back("alphaMode " + alpha.get<std::string>());
  if (emits(material)) features.push_back("light that it emits");
  const json &base = member(member(material, "pbrMetallicRoughness"), "baseColorTexture"),
             &both = member(member(material, "pbrMetallicRoughness"), "metallicRoughnessTexture"),
             &normal = member(material, "normalTexture");
  std::set<std::uint64_t> sets;
  bool clamped = false;
  for (const json* info : {&base, &both, &normal}) {
    if (info->is_null()) continue;
    sets.insert(number_or(member(*info, "texCoord"), 0));
    clamped |= is_clamped(root, *info);
  }
  if (sets.size() > 1) features.push_back("textures with different texture coordinates");
  if (clamped) features.push_back("textures that do not repeat");
  const json& extensions = member(material, "extensions");
  if (!extensions.is_object()) return features;
  for (const auto& [name, content] : extensions.items()) {
    const bool only_factor = content.is_object() && content.size() <= 1 && content.contains("specularFactor");
    if (name != "KHR_materials_specular" || !only_factor) features.push_back(name.substr(0, kMaxNameCharacters));
  }
  return features;
}

std::vector<std::string> not_drawn(const json& root) {
  std::set<std::uint64_t> used;
  for (const json& mesh : member(root, "meshes")) {
    for (const json& primitive : member(mesh, "primitives")) used.insert(number_or(member(primitive, "material"), -1));
  }
  struct Users {
    std::string first;
    std::size_t others = 0;
  };
  std::vector<std::pair<std::string, Users>> features;  // in the file's order
  const json& materials = member(root, "materials");
  for (std::size_t i = 0; materials.is_array() && i < materials.size(); ++i) {
    if (!used.contains(i)) continue;
    for (const std::string& feature : not_drawn_of(root, materials[i])) {
      const auto known =
          std::find_if(features.begin(), features.end(), [&](const auto& f) { return f.first == feature; });
      if (known != features.end()) {
        ++known->second.others;
      } else {
        features.push_back({feature, {name_of(materials[i], i)}});
      }
    }
  }
  std::vector<std::string> lines;
  for (const auto& [feature, users] : features) {
    lines.push_back(feature + " (" + users.first +
                    (users.others ? " and " + std::to_string(users.others) + " more" : std::string()) + ")");
  }
  for (const char* motion : {"animations", "skins"}) {
    if (const json& all = member(root, motion); all.is_array() && !all.empty()) lines.emplace_back(motion);
  }
  return lines;
}

}  // namespace

GltfExtras read_gltf_extras(const std::filesystem::path& file) {
  const json root = json::parse(json_part(file), nullptr, /*allow_exceptions=*/false);
  GltfExtras extras;
  if (!root.is_object()) return extras;
  extras.not_drawn = not_drawn(root);
  const json& materials = member(root, "materials");
  if (!materials.is_array()) return extras;
  for (const json& material : materials) {
    const json& factor = member(member(member(material, "extensions"), "KHR_materials_specular"), "specularFactor");
    extras.specular.push_back(factor.is_number() ? std::clamp(factor.get<float>(), 0.0f, 1.0f) : 1.0f);
  }
  return extras;
}

}  // namespace lumigraft::relight
