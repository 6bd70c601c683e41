// Reads glTF data that assimp 5.2 ignores.
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>

#include "relight/exhibit/model_materials.h"

namespace lumigraft::relight {
namespace {

using nlohmann::json;

// The JSON part of a file: all of a .gltf; the first chunk of a .glb (12 bytes of header, then length, type, data).
std::string_view json_part(const std::string& bytes) {
  if (bytes.compare(0, 4, "glTF") != 0 || bytes.size() < 20) return bytes;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, 4);
  return std::string_view(bytes).substr(20, length);
}

const json* member(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? &*found : nullptr;
}

}  // namespace

std::vector<float> gltf_specular_factors(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string_view text = json_part(bytes);
  if (text.find("KHR_materials_specular") == std::string_view::npos) return {};

  const json root = json::parse(text, nullptr, /*allow_exceptions=*/false);
  std::vector<float> factors;
  const json* materials = member(root, "materials");
  if (!materials || !materials->is_array()) return {};
  for (const json& material : *materials) {
    float factor = 1.0f;  // the extension's default
    const json* extensions = member(material, "extensions");
    const json* specular = extensions ? member(*extensions, "KHR_materials_specular") : nullptr;
    const json* value = specular ? member(*specular, "specularFactor") : nullptr;
    if (value && value->is_number()) factor = std::clamp(value->get<float>(), 0.0f, 1.0f);
    factors.push_back(factor);
  }
  return factors;
}

}  // namespace lumigraft::relight
