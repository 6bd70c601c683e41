#pragma once
// Materials of a glTF file: metallic-roughness with what of its extensions the BRDF here can express.
#include <cstddef>
#include <optional>

#include "relight/exhibit/alpha_cutout.h"
#include "relight/exhibit/gltf/textures.h"

namespace lumigraft::relight {

/// Specular factor of a material whose normal reflectance is that of KHR_materials_ior, times the factor of
/// KHR_materials_specular: 1 is an index of refraction of 1.5. Above 1, and for the index 0, that means total
/// reflection, `expressible` is false and the factor 1.
struct GltfSpecular {
  float factor = 1;
  bool expressible = true;
};
GltfSpecular specular_of(const GltfValue& material);

/// Where a material is opaque; nothing: everywhere. With the mode BLEND, which is not drawn, where alpha is at least a
/// half. `part`: what `read_material` gives of it. Throws InputError.
std::optional<AlphaMask> read_alpha(const GltfValue& material, const Model::Part& part, GltfTextures& textures);

/// A part without triangles; `material` may not exist: the default of the specification. Throws InputError.
Model::Part read_material(const GltfValue& material, GltfTextures& textures);

}  // namespace lumigraft::relight
