#pragma once
// Variants of the materials of a glTF file (KHR_materials_variants): sets of them by name, one of which is shown.
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "relight/exhibit/gltf/json_value.h"

namespace lumigraft::relight {

/// Their names; empty if the file has none. Throws InputError.
std::vector<std::string> read_variants(const GltfValue& root);

/// The reference to the material that a primitive has in a variant, by its number, or without one; it may not exist.
/// Throws InputError.
GltfValue material_in_variant(const GltfValue& primitive, std::optional<std::size_t> variant);

/// All that it may have, in any variant and without one.
std::vector<GltfValue> materials_of(const GltfValue& primitive);

}  // namespace lumigraft::relight
