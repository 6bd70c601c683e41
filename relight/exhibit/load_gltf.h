#pragma once
// Loads .gltf and .glb files. Implemented in gltf/.
#include <filesystem>
#include <memory>

#include "relight/exhibit/loading.h"

namespace lumigraft::relight {

/// As load_model(), which also refuses models without triangles. Parts are in the order of the file's materials, then
/// the triangles without one.
std::shared_ptr<const Model> load_gltf(const std::filesystem::path& file, char up, const LoadProgress& progress = {});

}  // namespace lumigraft::relight
