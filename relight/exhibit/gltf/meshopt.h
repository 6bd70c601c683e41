#pragma once
// Buffer views of EXT_meshopt_compression.
#include <cstdint>
#include <span>
#include <vector>

#include "relight/exhibit/gltf/json_value.h"

namespace lumigraft::relight {

/// `extension`: the view's, which says mode, filter, count and stride of what the bytes become. Throws InputError.
std::vector<std::uint8_t> decode_meshopt(const GltfValue& extension, std::span<const std::uint8_t> bytes);

}  // namespace lumigraft::relight
