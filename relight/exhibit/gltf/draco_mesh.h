#pragma once
// Meshes of KHR_draco_mesh_compression.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "relight/exhibit/gltf/accessor.h"

namespace draco {
class Mesh;
}

namespace lumigraft::relight {

class DracoMesh {
 public:
  /// `extension`: the primitive's. Throws InputError if the bytes are no mesh.
  DracoMesh(const GltfValue& extension, std::span<const std::uint8_t> bytes);
  ~DracoMesh();
  DracoMesh(const DracoMesh&) = delete;
  DracoMesh& operator=(const DracoMesh&) = delete;

  std::size_t vertices() const;
  std::vector<std::uint32_t> triangles() const;  ///< three indices each
  /// Of an attribute of the extension, converted as `format` says. Throws InputError if it is not in the data.
  std::vector<float> floats(const GltfValue& attribute, const GltfAccessorFormat& format) const;

 private:
  std::unique_ptr<draco::Mesh> mesh_;
};

}  // namespace lumigraft::relight
