#pragma once
// Materials of a glTF file: metallic-roughness with what of its extensions the BRDF here can express.
#include <cstddef>
#include <optional>

#include "relight/exhibit/alpha_cutout.h"
#include "relight/exhibit/gltf/textures.h"

namespace lumigraft::relight {

/// Whether KHR_materials_ior asks for total reflection, which is not drawn: its index is read as 1.5 then.
bool reflects_totally(const GltfValue& material);

/// Where a material is opaque; nothing: everywhere. With the mode BLEND where alpha is at least a half, for methods
/// without partial coverage. `part`: what `read_material` gives of it. Throws InputError.
std::optional<AlphaMask> read_alpha(const GltfValue& material, const Model::Part& part, GltfTextures& textures);

/// Whether a material has KHR_materials_unlit: nothing but its base colour and alpha counts.
bool is_unlit(const GltfValue& material);

/// A part without triangles; `material` may not exist: the default of the specification. Throws InputError.
Model::Part read_material(const GltfValue& material, GltfTextures& textures);

}  // namespace lumigraft::relight
