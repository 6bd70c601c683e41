#pragma once
// A .gltf or .glb file: its JSON, and the binary chunk of a .glb (glTF 2.0, section 4).
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "relight/exhibit/gltf/json_value.h"

namespace lumigraft::relight {

class GltfDocument {
 public:
  /// Throws InputError if the file is not glTF 2.0, or requires an extension that is not read here.
  explicit GltfDocument(const std::filesystem::path& file);
  ~GltfDocument();
  GltfDocument(const GltfDocument&) = delete;
  GltfDocument& operator=(const GltfDocument&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const GltfValue& root() const { return root_; }
  std::span<const std::uint8_t> binary_chunk() const { return binary_chunk_; }  ///< empty if there is none
  bool uses(const std::string& extension) const { return used_.contains(extension); }

 private:
  std::span<const std::uint8_t> json_text();
  void check_version() const;
  void read_extensions();

  std::filesystem::path file_;
  std::vector<std::uint8_t> bytes_;
  std::span<const std::uint8_t> binary_chunk_;
  std::unique_ptr<nlohmann::json> json_;
  GltfValue root_;
  std::set<std::string> used_;
};

/// The bytes of a regular file. Throws InputError, without the file's name, if there is none, or it has more bytes.
std::vector<std::uint8_t> read_bytes(const std::filesystem::path& file, std::uintmax_t max_bytes);

/// Extensions of which something is read.
bool is_read_of_gltf(std::string_view extension);

}  // namespace lumigraft::relight
