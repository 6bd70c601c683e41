#pragma once
// Animations of a glTF file.
#include <cstdint>
#include <map>
#include <vector>

#include "relight/exhibit/gltf/accessor.h"
#include "relight/exhibit/gltf/nodes.h"

namespace lumigraft::relight {

/// The morph targets of a node's mesh, as RigPose::morph_weights has them.
struct GltfMorphs {
  std::uint32_t first = 0, count = 0;
};

/// Those that move something of the scene; `morphs`: by the node's index in it. Channels of nodes that the scene does
/// not show, or of what an extension moves, are left out. Throws InputError.
std::vector<Rig::Animation> read_animations(const GltfDocument& document, GltfAccessors& accessors,
                                            const GltfScene& scene, const std::map<std::size_t, GltfMorphs>& morphs);

}  // namespace lumigraft::relight
