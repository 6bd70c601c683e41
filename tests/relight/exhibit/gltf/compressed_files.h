#pragma once
// Small compressed glTF files, made with the libraries' encoders.
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#include <meshoptimizer.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {

inline const std::vector<Eigen::Vector3f> kDracoSquare = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};

/// Two triangles with texture coordinates 3 (x, y), the colour (51, 102, 204) and normals along z, by Draco without
/// quantization. The accessors have no data of their own.
inline GltfFile draco_file() {
  draco::Mesh mesh;
  mesh.set_num_points(4);
  const auto add = [&](draco::GeometryAttribute::Type type, draco::DataType data, int components, std::size_t bytes,
                       const auto& value_of) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, static_cast<std::int8_t>(components), data, false,
                   static_cast<std::int64_t>(bytes) * components, 0);
    const int id = mesh.AddAttribute(attribute, true, 4);
    for (std::uint32_t v = 0; v < 4; ++v) {
      const auto value = value_of(kDracoSquare[v]);
      mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), value.data());
    }
    return mesh.attribute(id)->unique_id();
  };
  using draco::GeometryAttribute;
  const auto position =
      add(GeometryAttribute::POSITION, draco::DT_FLOAT32, 3, 4, [](const Eigen::Vector3f& p) { return p; });
  const auto normal = add(GeometryAttribute::NORMAL, draco::DT_FLOAT32, 3, 4,
                          [](const Eigen::Vector3f&) { return Eigen::Vector3f(0, 0, 1); });
  const auto texcoord = add(GeometryAttribute::TEX_COORD, draco::DT_FLOAT32, 2, 4,
                            [](const Eigen::Vector3f& p) { return Eigen::Vector2f(3 * p.head<2>()); });
  const auto color = add(GeometryAttribute::COLOR, draco::DT_UINT8, 3, 1, [](const Eigen::Vector3f&) {
    return std::vector<std::uint8_t>{51, 102, 204};
  });
  using draco::PointIndex;
  mesh.AddFace({PointIndex(0), PointIndex(1), PointIndex(2)});
  mesh.AddFace({PointIndex(0), PointIndex(2), PointIndex(3)});
  draco::EncoderBuffer encoded;
  draco::Encoder encoder;
  if (!encoder.EncodeMeshToBuffer(mesh, &encoded).ok()) throw std::runtime_error("Draco does not encode the mesh");

  GltfFile file;
  const int view = file.add_view({encoded.data(), encoded.size()});
  file.json["accessors"] = {{{"componentType", 5126}, {"count", 4}, {"type", "VEC3"}},
                            {{"componentType", 5126}, {"count", 4}, {"type", "VEC3"}},
                            {{"componentType", 5126}, {"count", 4}, {"type", "VEC2"}},
                            {{"componentType", 5121}, {"count", 4}, {"type", "VEC3"}, {"normalized", true}},
                            {{"componentType", 5123}, {"count", 6}, {"type", "SCALAR"}}};
  file.json["extensionsUsed"] = file.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  file.attributes() = {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}, {"COLOR_0", 3}};
  file.primitive()["indices"] = 4;
  file.primitive()["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", view},
      {"attributes", {{"POSITION", position}, {"NORMAL", normal}, {"TEXCOORD_0", texcoord}, {"COLOR_0", color}}}};
  return file;
}

constexpr std::uint32_t kMeshoptColumns = 9, kMeshoptTriangles = 2 * (kMeshoptColumns - 1) * (kMeshoptColumns - 1);

/// A relief of 8 × 8 squares, with its buffer views compressed or not; the mode is that of the indices. The
/// uncompressed buffer of the compressed file has no data.
inline GltfFile meshopt_file(bool compressed, const std::string& index_mode) {
  std::vector<float> positions, normals, texcoords;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t y = 0; y < kMeshoptColumns; ++y) {
    for (std::uint32_t x = 0; x < kMeshoptColumns; ++x) {
      const auto u = static_cast<float>(x), v = static_cast<float>(y);
      positions.insert(positions.end(), {u, v, 0.3f * std::sin(u) * std::cos(v)});
      const Eigen::Vector3f n = Eigen::Vector3f(-std::cos(u) * std::cos(v), std::sin(u) * std::sin(v), 2).normalized();
      normals.insert(normals.end(), {n.x(), n.y(), n.z(), 0});
      texcoords.insert(texcoords.end(), {u / 3, v / 7});
      if (x + 1 == kMeshoptColumns || y + 1 == kMeshoptColumns) continue;
      const std::uint32_t a = y * kMeshoptColumns + x, b = a + kMeshoptColumns;
      indices.insert(indices.end(), {a, a + 1, b, b, a + 1, b + 1});
    }
  }
  const std::size_t count = std::size_t{kMeshoptColumns} * kMeshoptColumns;
  std::vector<std::int8_t> octahedral(4 * count);
  meshopt_encodeFilterOct(octahedral.data(), count, 4, 8, normals.data());
  std::vector<float> exponential(2 * count);
  meshopt_encodeFilterExp(exponential.data(), count, 8, 15, texcoords.data());

  GltfFile file;
  file.json["bufferViews"] = file.json["accessors"] = nlohmann::json::array();
  std::size_t fallback_bytes = 0;
  const auto add = [&](const std::string& plain, std::size_t stride, const std::string& encoded, const char* mode,
                       const char* filter) {
    if (!compressed) {
      file.add_view(plain);
      return;
    }
    const auto view = static_cast<std::size_t>(file.add_view(encoded));
    nlohmann::json& json = file.json["bufferViews"][view];
    nlohmann::json extension = json;
    extension["byteStride"] = stride;
    extension["count"] = plain.size() / stride;
    extension["mode"] = mode;
    extension["filter"] = filter;
    json = {{"buffer", 1}, {"byteOffset", fallback_bytes}, {"byteLength", plain.size()}};
    json["extensions"]["EXT_meshopt_compression"] = extension;
    fallback_bytes += plain.size();
  };
  const auto encoded_vertices = [&](const void* data, std::size_t stride) {
    std::string bytes(meshopt_encodeVertexBufferBound(count, stride), 0);
    bytes.resize(
        meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), data, count, stride));
    return bytes;
  };
  const auto encoded_indices = [&] {
    const bool triangles = index_mode == "TRIANGLES";
    std::string bytes(std::max(meshopt_encodeIndexBufferBound(indices.size(), count),
                               meshopt_encodeIndexSequenceBound(indices.size(), count)),
                      0);
    auto* to = reinterpret_cast<unsigned char*>(bytes.data());
    bytes.resize(triangles ? meshopt_encodeIndexBuffer(to, bytes.size(), indices.data(), indices.size())
                           : meshopt_encodeIndexSequence(to, bytes.size(), indices.data(), indices.size()));
    return bytes;
  };
  std::vector<float> packed_normals;
  for (std::size_t i = 0; i < normals.size(); i += 4)
    packed_normals.insert(packed_normals.end(), {normals[i], normals[i + 1], normals[i + 2]});
  add(bytes_of(positions), 12, encoded_vertices(positions.data(), 12), "ATTRIBUTES", "NONE");
  add(compressed ? bytes_of(octahedral) : bytes_of(packed_normals), 4, encoded_vertices(octahedral.data(), 4),
      "ATTRIBUTES", "OCTAHEDRAL");
  add(bytes_of(texcoords), 8, encoded_vertices(exponential.data(), 8), "ATTRIBUTES", "EXPONENTIAL");
  add(bytes_of(indices), 4, encoded_indices(), index_mode.c_str(), "NONE");
  if (compressed) file.json["bufferViews"][1]["byteStride"] = 4;
  file.json["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5126}, {"count", count}, {"type", "VEC3"}},
      {{"bufferView", 1},
       {"componentType", compressed ? 5120 : 5126},
       {"count", count},
       {"type", "VEC3"},
       {"normalized", compressed}},
      {{"bufferView", 2}, {"componentType", 5126}, {"count", count}, {"type", "VEC2"}},
      {{"bufferView", 3}, {"componentType", 5125}, {"count", indices.size()}, {"type", "SCALAR"}}};
  file.json["extensionsUsed"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  file.attributes() = {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}};
  file.primitive()["indices"] = 3;
  if (compressed) {
    file.more_buffers = {
        {{"byteLength", fallback_bytes}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
  }
  return file;
}

}  // namespace lumigraft::test
