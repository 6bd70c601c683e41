#pragma once
// Small model files that tests write.
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace lumigraft::test {

/// A temporary folder, removed after the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "lumigraft-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline const std::string base64_alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

inline std::string to_base64(const std::string& bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? base64_alphabet[group >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

inline std::string from_base64(const std::string& text) {
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (char c : text) {
    const std::size_t value = base64_alphabet.find(c);
    if (value == std::string::npos) break;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255);
  }
  return bytes;
}

/// PNG, 2 by 1 pixels: red (255, 0, 0) and grey (188, 188, 188), which is 0.503 linear.
inline const std::string red_grey_png =
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAAD0lEQVR42mP4z8CwZ88eAAppAzSJw3cBAAAAAElFTkSuQmCC";
/// PNG, 2 by 1 pixels: (0, 255, 0) and (0, 0, 102). Mean of green 0.5, of blue 0.2.
inline const std::string green_blue_png =
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAAD0lEQVR42mNg+M/AwJAGAAVoAWaXi5oiAAAAAElFTkSuQmCC";

template <typename T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// A glTF file with one buffer of data; tests add other elements to `json`.
class GltfFile {
 public:
  nlohmann::json more_buffers = nlohmann::json::array();  ///< after it
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}}};

  /// A triangle mesh of (0,0,0), (1,0,0), (0,1,0) with texture coordinates at the centres of both texels.
  GltfFile() {
    const int positions = add({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    json["accessors"][positions]["min"] = {0, 0, 0};
    json["accessors"][positions]["max"] = {1, 1, 0};
    const int texcoords = add({0.25f, 0.5f, 0.75f, 0.5f, 0.25f, 0.5f}, "VEC2");
    json["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", texcoords}}}}}}}};
    json["nodes"] = {{{"mesh", 0}}};
  }

  int add(const std::vector<float>& values, const std::string& type) {
    const int width = type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 1;
    return add_accessor(bytes_of(values), type, 5126, static_cast<int>(values.size()) / width, false);
  }
  int add_accessor(const std::string& bytes, const std::string& type, int component_type, int count, bool normalized) {
    json["accessors"].push_back({{"bufferView", add_view(bytes)},
                                 {"componentType", component_type},
                                 {"count", count},
                                 {"type", type},
                                 {"normalized", normalized}});
    return static_cast<int>(json["accessors"].size()) - 1;
  }

  /// Bytes without an accessor; returns the number of their buffer view.
  int add_view(const std::string& bytes) {
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", bytes.size()}});
    data_ += bytes;
    data_.resize((data_.size() + 3) / 4 * 4);
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }

  nlohmann::json& primitive() { return json["meshes"][0]["primitives"][0]; }
  nlohmann::json& attributes() { return primitive()["attributes"]; }

  std::string gltf() const {
    nlohmann::json with_buffer = json;
    with_buffer["buffers"] = {
        {{"byteLength", data_.size()}, {"uri", "data:application/octet-stream;base64," + to_base64(data_)}}};
    append_buffers(&with_buffer);
    return with_buffer.dump();
  }
  std::string glb() const {
    nlohmann::json with_buffer = json;
    with_buffer["buffers"] = {{{"byteLength", data_.size()}}};
    append_buffers(&with_buffer);
    std::string text = with_buffer.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    const auto word = [](std::size_t value) { return bytes_of(std::vector{static_cast<std::uint32_t>(value)}); };
    out += word(2) + word(12 + 8 + text.size() + 8 + data_.size());
    out += word(text.size()) + "JSON" + text;
    out += word(data_.size()) + std::string("BIN\0", 4) + data_;
    return out;
  }

 private:
  void append_buffers(nlohmann::json* to) const {
    for (const nlohmann::json& buffer : more_buffers) (*to)["buffers"].push_back(buffer);
  }

  std::string data_;
};

/// ASCII PLY of a unit square in z = 0, counter-clockwise from (0, 0), as one quad.
inline std::string ply_square(const std::string& color_type = "", const std::vector<std::string>& colors = {}) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
  if (!color_type.empty()) {
    for (const char* name : {"red", "green", "blue"}) text += "property " + color_type + " " + name + "\n";
  }
  text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::vector<std::string> places = {"0 0 0", "1 0 0", "1 1 0", "0 1 0"};
  for (std::size_t v = 0; v < 4; ++v) text += places[v] + (colors.empty() ? "" : " " + colors[v]) + "\n";
  return text + "4 0 1 2 3\n";
}

}  // namespace lumigraft::test
