#include "relight/exhibit/gltf/draco_mesh.h"

#include <draco/compression/decode.h>

#include <limits>
#include <new>
#include <string>
#include <utility>

namespace lumigraft::relight {

DracoMesh::DracoMesh(const GltfValue& extension, std::span<const std::uint8_t> bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::string reason;
  try {
    auto decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
    if (decoded.ok())
      mesh_ = std::move(decoded).value();
    else
      reason = decoded.status().error_msg_string();
  } catch (const std::bad_alloc&) {
    reason = "out of memory";
  } catch (const std::length_error& error) {
    reason = error.what();
  }
  if (!mesh_) extension.fail("found data that Draco cannot decode (" + reason.substr(0, 100) + "), allowed: a mesh");
}

DracoMesh::~DracoMesh() = default;

std::size_t DracoMesh::vertices() const { return mesh_->num_points(); }

std::vector<std::uint32_t> DracoMesh::triangles() const {
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * std::size_t{mesh_->num_faces()});
  for (draco::FaceIndex face(0); face < mesh_->num_faces(); ++face) {
    for (const draco::PointIndex& point : mesh_->face(face)) indices.push_back(point.value());
  }
  return indices;
}

std::vector<float> DracoMesh::floats(const GltfValue& attribute, const GltfAccessorFormat& format) const {
  const std::size_t id = attribute.integer(0, std::numeric_limits<std::uint32_t>::max());
  const draco::PointAttribute* from = mesh_->GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
  if (!from) attribute.refuse("the identifier of an attribute of the compressed mesh");
  if (static_cast<std::size_t>(from->num_components()) != format.components) {
    attribute.fail("found " + std::to_string(from->num_components()) + " components, allowed: the " +
                   std::to_string(format.components) + " of its accessor");
  }
  std::vector<float> values(vertices() * format.components);
  for (draco::PointIndex point(0); point < mesh_->num_points(); ++point) {
    float* to = &values[std::size_t{point.value()} * format.components];
    if (!from->ConvertValue(from->mapped_index(point), from->num_components(), to)) {
      attribute.fail("found values that are no numbers, allowed: numbers");
    }
    if (!format.normalized || from->normalized()) continue;  // the latter are converted already
    for (std::size_t k = 0; k < format.components; ++k) to[k] = format.from_integer(to[k]);
  }
  return values;
}

}  // namespace lumigraft::relight
