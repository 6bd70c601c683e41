// Geometry of glTF files: primitives, attributes of all types, nodes.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using std::int16_t, std::int8_t, std::uint16_t, std::uint32_t, std::uint8_t;

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125;

/// Five points of a zigzag in the plane z = 0.
GltfFile zigzag(int mode) {
  GltfFile file;
  file.attributes() = {{"POSITION", file.add({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}, "VEC3")}};
  file.primitive()["mode"] = mode;
  return file;
}
const std::vector<Vector3f> kZigzag = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}};

std::vector<Vector3f> triangles(const std::vector<std::size_t>& indices) {
  std::vector<Vector3f> corners;
  for (const std::size_t i : indices) corners.push_back(kZigzag[i]);
  return corners;
}

TEST(GltfMeshes, StripsFansAndTrianglesWithoutIndices) {
  EXPECT_TRUE(same(corners_of(*loaded(zigzag(5).gltf())), triangles({0, 1, 2, 1, 3, 2, 2, 3, 4})));
  EXPECT_TRUE(same(corners_of(*loaded(zigzag(6).gltf())), triangles({1, 2, 0, 2, 3, 0, 3, 4, 0})))
      << "each begins at the specification's first corner; the last two share an edge with the centre";
  EXPECT_TRUE(same(corners_of(*loaded(GltfFile().gltf())), triangles({0, 1, 2})));
}

TEST(GltfMeshes, IndicesOfAllTypes) {
  const auto model_of = [](const std::string& bytes, int type, int mode) {
    GltfFile file = zigzag(mode);
    file.primitive()["indices"] = file.add_accessor(bytes, "SCALAR", type, 3, false);
    return corners_of(*loaded(file.gltf()));
  };
  for (const int mode : {4, 5, 6}) {
    const std::vector<Vector3f> expected =
        triangles(mode == 6 ? std::vector<std::size_t>{3, 4, 1} : std::vector<std::size_t>{1, 3, 4});
    EXPECT_TRUE(same(model_of(bytes_of(std::vector<uint8_t>{1, 3, 4}), kUnsignedByte, mode), expected)) << mode;
    EXPECT_TRUE(same(model_of(bytes_of(std::vector<uint16_t>{1, 3, 4}), kUnsignedShort, mode), expected)) << mode;
    EXPECT_TRUE(same(model_of(bytes_of(std::vector<uint32_t>{1, 3, 4}), kUnsignedInt, mode), expected)) << mode;
  }
}

TEST(GltfMeshes, PointsAndLinesAreNamed) {
  GltfFile file;
  nlohmann::json points = file.primitive();
  points["mode"] = 0;
  file.json["meshes"][0]["primitives"].push_back(points);
  const auto model = loaded(file.gltf());
  EXPECT_EQ(model->indices.size(), 3u);
  EXPECT_EQ(model->not_drawn, std::vector<std::string>{"points and lines"});
}

TEST(GltfMeshes, MissingNormalsAreThoseOfTheFace) {
  const auto model = loaded(GltfFile().gltf());
  for (const Vector3f& normal : model->normals) EXPECT_LT((normal - Vector3f::UnitZ()).norm(), 1e-6f);
}

TEST(GltfMeshes, VertexColorsOfAllTypes) {
  const auto color = [](const std::string& type, const std::string& bytes, int component) {
    GltfFile file;
    file.attributes()["COLOR_0"] = file.add_accessor(bytes, type, component, 3, component != 5126);
    return loaded(file.gltf())->colors[0];
  };
  const Vector3f expected(0.2f, 0.4f, 0.8f);
  const auto thrice = [](const auto& values) {
    std::string bytes = bytes_of(values);
    return bytes + bytes + bytes;
  };
  EXPECT_LT((color("VEC3", thrice(std::vector<float>{0.2f, 0.4f, 0.8f}), 5126) - expected).norm(), 1e-6f);
  EXPECT_LT((color("VEC4", thrice(std::vector<float>{0.2f, 0.4f, 0.8f, 0.5f}), 5126) - expected).norm(), 1e-6f);
  EXPECT_LT((color("VEC4", thrice(std::vector<uint8_t>{51, 102, 204, 9}), kUnsignedByte) - expected).norm(), 1e-6f);
  EXPECT_LT((color("VEC3", thrice(std::vector<uint16_t>{13107, 26214, 52428}), kUnsignedShort) - expected).norm(),
            1e-6f);
  EXPECT_LT((color("VEC4", thrice(std::vector<uint16_t>{13107, 26214, 52428, 7}), kUnsignedShort) - expected).norm(),
            1e-6f);
}

/// Positions of 16 bits, normals and tangents of 8, and texture coordinates that are not normalized, of a mesh that a
/// node brings to its size.
TEST(GltfMeshes, QuantizedMesh) {
  GltfFile file;
  file.json["extensionsUsed"] = file.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  file.attributes() = {
      {"POSITION",
       file.add_accessor(bytes_of(std::vector<int16_t>{0, 0, 0, 32767, 0, 0, 0, -32767, 0}), "VEC3", kShort, 3, true)},
      {"NORMAL", file.add_accessor(bytes_of(std::vector<int8_t>{0, 0, -127, 0, 0, 0, -127, 0, 0, 0, -127, 0}), "VEC3",
                                   kByte, 3, true)},
      {"TEXCOORD_0",
       file.add_accessor(bytes_of(std::vector<uint16_t>{0, 0, 3, 0, 0, 2}), "VEC2", kUnsignedShort, 3, false)}};
  file.json["bufferViews"][file.json["accessors"][3]["bufferView"].get<std::size_t>()]["byteStride"] = 4;
  file.json["nodes"][0]["scale"] = {2, 2, 2};
  const auto model = loaded(file.gltf());
  EXPECT_TRUE(same(corners_of(*model), {{0, 0, 0}, {2, 0, 0}, {0, -2, 0}}));
  for (const Vector3f& normal : model->normals) EXPECT_LT((normal + Vector3f::UnitZ()).norm(), 1e-6f);
  EXPECT_EQ(model->texcoords[vertex_at(*model, {2, 0, 0})], Vector2f(3, 0));
  EXPECT_EQ(model->texcoords[vertex_at(*model, {0, -2, 0})], Vector2f(0, 2));

  const auto position = [](const std::string& bytes, int type, bool normalized) {
    GltfFile quantized;
    quantized.json["extensionsUsed"] = {"KHR_mesh_quantization"};
    quantized.attributes() = {{"POSITION", quantized.add_accessor(bytes, "VEC3", type, 3, normalized)}};
    return corners_of(*loaded(quantized.gltf()));
  };
  const std::vector<Vector3f> normalized = {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_TRUE(same(position(bytes_of(std::vector<int8_t>{-128, 0, 0, 127, 0, 0, 0, 127, 0}), kByte, true), normalized))
      << "-128 is -1, too";
  EXPECT_TRUE(
      same(position(bytes_of(std::vector<int16_t>{-32768, 0, 0, 32767, 0, 0, 0, 32767, 0}), kShort, true), normalized));
  EXPECT_TRUE(same(position(bytes_of(std::vector<uint8_t>{0, 0, 9, 200, 0, 9, 0, 200, 9}), kUnsignedByte, false),
                   {{0, 0, 9}, {200, 0, 9}, {0, 200, 9}}));
  EXPECT_TRUE(same(position(bytes_of(std::vector<uint16_t>{0, 0, 9, 2000, 0, 9, 0, 2000, 9}), kUnsignedShort, false),
                   {{0, 0, 9}, {2000, 0, 9}, {0, 2000, 9}}));
}

TEST(GltfMeshes, SparseAccessors) {
  GltfFile file;
  const int indices = file.add_view(bytes_of(std::vector<uint8_t>{0, 2}));
  const int values = file.add_view(bytes_of(std::vector<float>{-1, 0, 5, 0, 2, 5}));
  auto& position = file.json["accessors"][0];
  position["sparse"] = {{"count", 2},
                        {"indices", {{"bufferView", indices}, {"componentType", kUnsignedByte}}},
                        {"values", {{"bufferView", values}}}};
  EXPECT_TRUE(same(corners_of(*loaded(file.gltf())), {{-1, 0, 5}, {1, 0, 0}, {0, 2, 5}}));
  position.erase("bufferView");  // zeros where nothing replaces them
  EXPECT_TRUE(same(corners_of(*loaded(file.gltf())), {{-1, 0, 5}, {0, 0, 0}, {0, 2, 5}}));
}

TEST(GltfMeshes, InterleavedAttributes) {
  GltfFile file;
  std::vector<float> vertices;
  for (const Vector3f& p : {kZigzag[0], kZigzag[1], kZigzag[2]}) {
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z(), 0, 0.6f, 0.8f, 7 + p.x(), 8 + p.y()});
  }
  const int view = file.add_view("pad." + bytes_of(vertices));
  file.json["bufferViews"][static_cast<std::size_t>(view)]["byteStride"] = 32;
  const auto attribute = [&](int offset, const char* type) {
    file.json["accessors"].push_back(
        {{"bufferView", view}, {"byteOffset", 4 + offset}, {"componentType", 5126}, {"count", 3}, {"type", type}});
    return file.json["accessors"].size() - 1;
  };
  file.attributes() = {
      {"POSITION", attribute(0, "VEC3")}, {"NORMAL", attribute(12, "VEC3")}, {"TEXCOORD_0", attribute(24, "VEC2")}};
  const auto model = loaded(file.gltf());
  EXPECT_TRUE(same(corners_of(*model), triangles({0, 1, 2})));
  for (const Vector3f& normal : model->normals) EXPECT_LT((normal - Vector3f(0, 0.6f, 0.8f)).norm(), 1e-6f);
  EXPECT_EQ(model->texcoords[vertex_at(*model, {1, 0, 0})], Vector2f(8, 8));
}

TEST(GltfMeshes, ANodeTreeShowsAMeshTwice) {
  GltfFile file;
  const float s = std::sqrt(0.5f);
  // A quarter turn about z and a shift; the same as a matrix, by columns, below a parent that moves along z.
  file.json["scenes"] = {{{"nodes", {0, 2}}}};
  file.json["nodes"] = {{{"mesh", 0}, {"translation", {5, 0, 0}}, {"rotation", {0, 0, s, s}}},
                        {{"mesh", 0}, {"matrix", {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1}}},
                        {{"children", {1}}, {"translation", {0, 0, 3}}}};
  const auto model = loaded(file.gltf());
  EXPECT_TRUE(same(corners_of(*model), {{5, 0, 0}, {5, 1, 0}, {4, 0, 0}, {5, 0, 3}, {5, 1, 3}, {4, 0, 3}}));
  EXPECT_EQ(model->parts.size(), 1u);
}

TEST(GltfMeshes, TheSceneThatTheFileShowsFirst) {
  GltfFile file;
  file.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {0, 0, 9}}}};
  file.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  file.json["scene"] = 1;
  EXPECT_EQ(corners_of(*loaded(file.gltf()))[0].z(), 9);
}

/// A tangent along x, of a mesh that a mirrored node stretches along x.
TEST(GltfMeshes, MirroredNodesMirrorTheHandednessOfTangents) {
  GltfFile file;
  file.json["images"] = {{{"uri", "data:image/png;base64," + green_blue_png}}};
  file.json["textures"] = {{{"source", 0}}};
  file.json["materials"] = {{{"normalTexture", {{"index", 0}}}}};
  file.primitive()["material"] = 0;
  file.attributes()["NORMAL"] = file.add({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  file.attributes()["TANGENT"] = file.add({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4");
  for (const float x : {3.0f, -3.0f}) {
    file.json["nodes"][0]["scale"] = {x, 1, 1};
    const auto model = loaded(file.gltf());
    ASSERT_EQ(model->tangents.size(), 3u);
    const Eigen::Vector4f expected(std::copysign(1.0f, x), 0, 0, std::copysign(1.0f, x));
    for (const Eigen::Vector4f& tangent : model->tangents) EXPECT_LT((tangent - expected).norm(), 1e-6f);
    // The bitangent is that of the mesh.
    EXPECT_LT((expected.w() * model->normals[0].cross(Vector3f(expected.head<3>())) - Vector3f::UnitY()).norm(), 1e-6f);
  }
  file.attributes().erase("NORMAL");
  EXPECT_TRUE(loaded(file.gltf())->tangents.empty()) << "tangents without normals have no meaning";
}

}  // namespace
}  // namespace lumigraft::test
