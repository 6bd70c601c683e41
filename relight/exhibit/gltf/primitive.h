#pragma once
// Triangles of a mesh primitive and their vertices' attributes.
#include <array>
#include <cstdint>
#include <vector>

#include "relight/exhibit/gltf/accessor.h"
#include "relight/exhibit/model_corners.h"

namespace lumigraft::relight {

/// In the mesh's frame.
struct GltfPrimitive {
  std::vector<Corner> vertices;
  std::vector<std::uint32_t> indices;  ///< three per triangle

  std::size_t influences = 0;          ///< of a skin, per vertex; 0: it has none
  std::vector<float> joints, weights;  ///< so many per vertex
  /// What a morph target adds, three numbers per vertex; empty: nothing.
  struct Target {
    std::vector<float> positions_m, normals, tangents;
  };
  std::vector<Target> targets;
};

/// Attributes that only some materials need. Vertices that differ in others alone are merged.
struct GltfNeeds {
  bool second_texcoords = false;
  bool tangents = false;  ///< where the file has normals: without these, tangents have no meaning
  bool rig = false;       ///< what skins and morph targets have of vertices
};

/// Of a primitive of triangles, strips or fans, compressed by Draco or not; empty if it has no positions. What is not
/// needed or not in the file stays as in Corner. Throws InputError.
GltfPrimitive read_primitive(const GltfDocument& document, GltfBuffers& buffers, GltfAccessors& accessors,
                             const GltfValue& primitive, const GltfNeeds& needs);

/// Whether a primitive has triangles; else it has points or lines. Throws InputError if it has neither.
bool has_triangles(const GltfValue& primitive);

}  // namespace lumigraft::relight
