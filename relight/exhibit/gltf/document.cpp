#include "relight/exhibit/gltf/document.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "capture/error.h"
#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

std::uint32_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));  // little-endian, as all machines that this runs on
  return word;
}

/// After the chunk header at `at`, which must be within the bytes. Throws InputError without the file's name.
std::span<const std::uint8_t> chunk(std::span<const std::uint8_t> bytes, std::size_t at, const char* name) {
  const std::size_t length = word_at(bytes, at), left = bytes.size() - at - kChunkHeaderBytes;
  capture::refuse_if(length > left, std::string(name) + " chunk: found a length of " + std::to_string(length) +
                                        " bytes, allowed: at most the " + std::to_string(left) + " that are left");
  return bytes.subspan(at + kChunkHeaderBytes, length);
}

}  // namespace

bool is_read_of_gltf(std::string_view extension) {
  constexpr std::array<std::string_view, 15> kRead = {
      "EXT_meshopt_compression",    "EXT_texture_webp",        "KHR_draco_mesh_compression",
      "KHR_materials_anisotropy",   "KHR_materials_clearcoat", "KHR_materials_emissive_strength",
      "KHR_materials_ior",          "KHR_materials_sheen",     "KHR_materials_specular",
      "KHR_materials_transmission", "KHR_materials_unlit",     "KHR_materials_variants",
      "KHR_materials_volume",       "KHR_mesh_quantization",   "KHR_texture_transform"};
  return std::find(kRead.begin(), kRead.end(), extension) != kRead.end();
}

std::vector<std::uint8_t> read_bytes(const fs::path& file, std::uintmax_t max_bytes) {
  std::error_code ignored;
  capture::refuse_if(!fs::is_regular_file(file, ignored), "no such file");
  const std::uintmax_t size = fs::file_size(file, ignored);
  capture::refuse_if(size > max_bytes,
                     "found " + std::to_string(size) + " bytes, allowed: at most " + std::to_string(max_bytes));
  std::vector<std::uint8_t> bytes(size);
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  capture::refuse_if(in.gcount() != static_cast<std::streamsize>(bytes.size()), "cannot be read");
  return bytes;
}

GltfDocument::~GltfDocument() = default;

GltfDocument::GltfDocument(const fs::path& file)
    : file_(file), json_(std::make_unique<nlohmann::json>()), root_(file.string(), *json_) {
  capture::with_error_context(file.string(), [&] {
    bytes_ = read_bytes(file, kGltf.max_file_bytes);
    const std::span<const std::uint8_t> text = json_text();
    try {
      *json_ = nlohmann::json::parse(text.begin(), text.end());
    } catch (const nlohmann::json::parse_error& error) {
      throw capture::InputError("not a model that can be read: found a fault at byte " + std::to_string(error.byte) +
                                " of its JSON, allowed: glTF 2.0");
    } catch (const nlohmann::json::exception&) {
      throw capture::InputError(
          "not a model that can be read: found a number in its JSON that no double holds, allowed: glTF 2.0");
    }
  });
  if (!json_->is_object()) root_.refuse("an object");
  check_version();
  read_extensions();
}

/// All of a .gltf; the first chunk of a .glb, whose second is kept.
std::span<const std::uint8_t> GltfDocument::json_text() {
  const std::span<const std::uint8_t> all = bytes_;
  if (all.size() < 4 || std::memcmp(all.data(), "glTF", 4) != 0) return all;
  const auto refuse = [](const std::string& why) { throw capture::InputError("not a model that can be read: " + why); };
  if (all.size() < kHeaderBytes + kChunkHeaderBytes)
    refuse("found " + std::to_string(all.size()) + " bytes of a GLB, allowed: at least 20");
  const std::uint32_t version = word_at(all, 4), length = word_at(all, 8);
  if (version != 2) refuse("found version " + std::to_string(version) + " of GLB, allowed: 2");
  if (length > all.size()) {
    refuse("found " + std::to_string(all.size()) + " bytes, allowed: the " + std::to_string(length) + " of its header");
  }
  if (word_at(all, kHeaderBytes + 4) != kJsonChunk) refuse("found another first chunk, allowed: JSON");
  const std::span<const std::uint8_t> text = chunk(all, kHeaderBytes, "JSON");
  const std::size_t after = kHeaderBytes + kChunkHeaderBytes + (text.size() + 3) / 4 * 4;
  if (after + kChunkHeaderBytes <= all.size() && word_at(all, after + 4) == kBinaryChunk) {
    binary_chunk_ = chunk(all, after, "binary");
  }
  return text;
}

void GltfDocument::check_version() const {
  const GltfValue version = root_.member("asset").member("version");
  if (!version.exists() || !version.text().starts_with("2.")) version.refuse("\"2.0\"");
  const GltfValue min_version = root_.member("asset").member("minVersion");
  if (min_version.exists() && min_version.text() != "2.0") min_version.refuse("\"2.0\"");
}

void GltfDocument::read_extensions() {
  const GltfValue used = root_.member("extensionsUsed"), required = root_.member("extensionsRequired");
  for (std::size_t i = 0; i < used.size(); ++i) used_.insert(used[i].text());
  for (std::size_t i = 0; i < required.size(); ++i) {
    if (!is_read_of_gltf(required[i].text())) required[i].refuse("an extension that is read here");
    used_.insert(required[i].text());
  }
}

}  // namespace lumigraft::relight
