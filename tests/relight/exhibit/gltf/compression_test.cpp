// Compressed meshes, against the same meshes without compression.
#include <algorithm>
#include <cstdint>

#include "tests/relight/exhibit/gltf/compressed_files.h"
#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

TEST(GltfCompression, Draco) {
  const auto model = loaded(draco_file().glb(), "a.glb");
  ASSERT_EQ(model->indices.size(), 6u);
  EXPECT_EQ(model->positions_m.size(), 4u);
  for (const Vector3f& p : kDracoSquare) {
    const std::size_t v = vertex_at(*model, p);
    EXPECT_LT((model->colors[v] - Vector3f(51, 102, 204) / 255).norm(), 1e-6f) << "normalized integers";
    EXPECT_LT((model->texcoords[v] - 3 * p.head<2>()).norm(), 1e-6f);
    EXPECT_LT((model->normals[v] - Vector3f::UnitZ()).norm(), 1e-6f);
  }
}

TEST(GltfCompression, DracoThatIsBroken) {
  GltfFile file = draco_file();
  file.json["accessors"][0]["count"] = 5;
  EXPECT_EQ(refusal_of(file.gltf()),
            "meshes[0].primitives[0].attributes.POSITION: found 5 elements, allowed: 4, as of the compressed mesh");
  file = draco_file();
  file.primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 17;
  EXPECT_EQ(refusal_of(file.gltf()),
            "meshes[0].primitives[0].extensions.KHR_draco_mesh_compression.attributes.POSITION: found 17, allowed: the "
            "identifier of an attribute of the compressed mesh");
  file = draco_file();
  file.json["bufferViews"].back()["byteLength"] = 20;
  EXPECT_TRUE(refusal_of(file.gltf())
                  .starts_with("meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: found data that Draco "
                               "cannot decode"));
}

/// Triangles that begin with their lowest corner: the codec of triangles keeps their order, but turns them.
std::vector<Vector3f> unturned(std::vector<Vector3f> corners) {
  const auto before = [](const Vector3f& a, const Vector3f& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  for (auto triangle = corners.begin(); triangle != corners.end(); triangle += 3)
    std::rotate(triangle, std::min_element(triangle, triangle + 3, before), triangle + 3);
  return corners;
}

TEST(GltfCompression, Meshopt) {
  const auto plain = loaded(meshopt_file(false, "TRIANGLES").gltf());
  ASSERT_EQ(plain->indices.size(), 3 * kMeshoptTriangles);
  for (const char* mode : {"TRIANGLES", "INDICES"}) {
    const auto model = loaded(meshopt_file(true, mode).glb(), "a.glb");
    EXPECT_TRUE(same(unturned(corners_of(*model)), unturned(corners_of(*plain)), 0)) << mode;
    for (const Vector3f& p : plain->positions_m) {
      const std::size_t a = vertex_at(*plain, p), b = vertex_at(*model, p);
      EXPECT_LT((model->normals[b] - plain->normals[a]).norm(), 0.015f) << "octahedral: steps of 1/127";
      EXPECT_LT((model->texcoords[b] - plain->texcoords[a]).norm(), 2e-4f) << "exponential: 14 bits for values up to 4";
    }
  }
}

TEST(GltfCompression, MeshoptThatIsBroken) {
  const auto refusal = [](const char* key, const nlohmann::json& value) {
    GltfFile file = meshopt_file(true, "TRIANGLES");
    file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
    return refusal_of(file.gltf());
  };
  const std::string where = "bufferViews[0].extensions.EXT_meshopt_compression";
  EXPECT_EQ(refusal("mode", "COLORS"), where + ".mode: found \"COLORS\", allowed: ATTRIBUTES, TRIANGLES or INDICES");
  EXPECT_EQ(refusal("filter", "NICE"), where +
                                           ".filter: found \"NICE\", allowed: NONE, OCTAHEDRAL, QUATERNION or "
                                           "EXPONENTIAL");
  EXPECT_EQ(refusal("filter", "OCTAHEDRAL"),
            where + ".byteStride: found 12, allowed: 4 or 8 with the filter OCTAHEDRAL");
  EXPECT_EQ(refusal("byteStride", 6), where + ".byteStride: found 6, allowed: a multiple of 4");
  EXPECT_EQ(refusal("count", 40'000'000),
            where + ".count: found 40000000, allowed: at most 128 bytes per compressed byte");
  EXPECT_EQ(refusal("byteLength", 20),
            where + ": found data that cannot be decompressed, allowed: meshoptimizer's codec, version 0 or 1");
}

}  // namespace
}  // namespace lumigraft::test
