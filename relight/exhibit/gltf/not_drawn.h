#pragma once
// Names what a glTF file asks for and is not drawn.
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "relight/exhibit/gltf/textures.h"

namespace lumigraft::relight {

/// As Model::not_drawn. `materials`: indices of those that triangles have. Throws InputError.
std::vector<std::string> gltf_not_drawn(const GltfDocument& document, const GltfTextures& textures,
                                        const std::set<std::size_t>& materials);

/// As Model::blended, of these materials.
std::string gltf_blended(const GltfDocument& document, const std::set<std::size_t>& materials);

}  // namespace lumigraft::relight
