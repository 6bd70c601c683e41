#pragma once
// What a URI of a glTF file refers to: data in the URI itself, or a file beside the model.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "relight/exhibit/gltf/json_value.h"

namespace lumigraft::relight {

/// Bytes of a "data:" URI with base64, or of a file relative to the model's folder; %20 is a space in its name. Throws
/// InputError where there is neither, or more than `max_bytes`.
std::vector<std::uint8_t> read_uri(const GltfValue& uri, const std::filesystem::path& folder, std::size_t max_bytes);

}  // namespace lumigraft::relight
