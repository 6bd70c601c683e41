// Broken glTF files: each is refused in a sentence that says where, what was found and what is allowed.
#include <sys/resource.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

struct Case {
  std::string expected;
  std::function<void(GltfFile&)> damage;
};

/// A triangle with indices, a texture and a second, unused set of coordinates.
GltfFile sound() {
  GltfFile file;
  file.primitive()["indices"] =
      file.add_accessor(bytes_of(std::vector<std::uint16_t>{0, 1, 2}), "SCALAR", 5123, 3, false);
  file.json["images"] = {{{"uri", "data:image/png;base64," + red_grey_png}, {"mimeType", "image/png"}}};
  file.json["samplers"] = {{{"wrapS", 10497}}};
  file.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  file.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  file.primitive()["material"] = 0;
  return file;
}

void expect_refusals(const std::vector<Case>& cases) {
  ASSERT_EQ(refusal_of(sound().gltf()), "");
  for (const Case& c : cases) {
    GltfFile file = sound();
    c.damage(file);
    EXPECT_EQ(refusal_of(file.gltf()), c.expected);
  }
}

TEST(GltfRefusals, Documents) {
  expect_refusals({
      {"asset.version: found \"1.0\", allowed: \"2.0\"", [](GltfFile& f) { f.json["asset"]["version"] = "1.0"; }},
      {"asset.version: found none, allowed: \"2.0\"", [](GltfFile& f) { f.json.erase("asset"); }},
      {"asset.minVersion: found \"2.1\", allowed: \"2.0\"", [](GltfFile& f) { f.json["asset"]["minVersion"] = "2.1"; }},
      {"extensionsRequired[0]: found \"KHR_materials_iridescence\", allowed: an extension that is read here",
       [](GltfFile& f) { f.json["extensionsRequired"] = {"KHR_materials_iridescence"}; }},
      {"extensionsUsed: found an object, allowed: an array",
       [](GltfFile& f) {
         f.json["extensionsUsed"] = {{"a", 1}};
       }},
      {"scene: found 7, allowed: the number of one of 1 scenes", [](GltfFile& f) { f.json["scene"] = 7; }},
      {"scenes: found none, allowed: at least one scene", [](GltfFile& f) { f.json.erase("scenes"); }},
      {"meshes[0].primitives: found \"x\", allowed: an array",
       [](GltfFile& f) { f.json["meshes"][0]["primitives"] = "x"; }},
      {"found no triangles with an area, allowed: at least one", [](GltfFile& f) { f.attributes().erase("POSITION"); }},
  });
  EXPECT_EQ(refusal_of("[1]"), "found an array of 1, allowed: an object");
  EXPECT_EQ(refusal_of("{\"asset\": 1e999}"),
            "not a model that can be read: found a number in its JSON that no double holds, allowed: glTF 2.0");
  EXPECT_EQ(refusal_of("{\"asset\": "),
            "not a model that can be read: found a fault at byte 11 of its JSON, allowed: glTF 2.0");
  EXPECT_EQ(refusal_of("{\"asset\": {\"version\": \"2.0\"}, \"extras\":" + std::string(1'000'000, '[') +
                       std::string(1'000'000, ']') + "}"),
            "scenes: found none, allowed: at least one scene")
      << "nested, but not read";
}

TEST(GltfRefusals, BinaryChunks) {
  const std::string glb = sound().glb();
  const auto with_word = [&](std::size_t at, std::uint32_t word) {
    std::string bytes = glb;
    std::memcpy(bytes.data() + at, &word, sizeof(word));
    return refusal_of(bytes, "a.glb");
  };
  std::uint32_t json_bytes = 0;
  std::memcpy(&json_bytes, glb.data() + 12, 4);
  const std::size_t binary = 20 + json_bytes;
  EXPECT_EQ(refusal_of(glb, "a.glb"), "");
  EXPECT_EQ(refusal_of(glb, "a.gltf"), "") << "the content counts";
  EXPECT_EQ(with_word(4, 1), "not a model that can be read: found version 1 of GLB, allowed: 2");
  EXPECT_EQ(with_word(16, 0), "not a model that can be read: found another first chunk, allowed: JSON");
  EXPECT_EQ(refusal_of(glb.substr(0, glb.size() - 4), "a.glb"),
            "not a model that can be read: found " + std::to_string(glb.size() - 4) + " bytes, allowed: the " +
                std::to_string(glb.size()) + " of its header");
  EXPECT_EQ(with_word(12, 4'000'000'000), "JSON chunk: found a length of 4000000000 bytes, allowed: at most the " +
                                              std::to_string(glb.size() - 20) + " that are left");
  const std::size_t left = glb.size() - binary - 8;
  EXPECT_EQ(with_word(binary, static_cast<std::uint32_t>(left + 8)),
            "binary chunk: found a length of " + std::to_string(left + 8) + " bytes, allowed: at most the " +
                std::to_string(left) + " that are left");
  EXPECT_EQ(refusal_of("glTF", "a.glb"), "not a model that can be read: found 4 bytes of a GLB, allowed: at least 20");
}

TEST(GltfRefusals, Buffers) {
  expect_refusals({
      {"bufferViews[0]: found bytes 0 to 4000, allowed: the 68 of its buffer",
       [](GltfFile& f) { f.json["bufferViews"][0]["byteLength"] = 4000; }},
      {"bufferViews[0]: found bytes 60 to 96, allowed: the 68 of its buffer",
       [](GltfFile& f) { f.json["bufferViews"][0]["byteOffset"] = 60; }},
      {"bufferViews[0].byteLength: found -1, allowed: an integer from 1 to 2147483648",
       [](GltfFile& f) { f.json["bufferViews"][0]["byteLength"] = -1; }},
      {"bufferViews[0].byteOffset: found 18446744073709551615, allowed: an integer from 0 to 2147483648",
       [](GltfFile& f) { f.json["bufferViews"][0]["byteOffset"] = std::numeric_limits<std::uint64_t>::max(); }},
      {"bufferViews[0].byteStride: found 2, allowed: an integer from 4 to 252",
       [](GltfFile& f) { f.json["bufferViews"][0]["byteStride"] = 2; }},
      {"accessors[0]: found elements of 12 bytes, allowed: at most the byteStride 4 of its view",
       [](GltfFile& f) { f.json["bufferViews"][0]["byteStride"] = 4; }},
      {"bufferViews[0].buffer: found 3, allowed: the number of one of 1 buffers",
       [](GltfFile& f) { f.json["bufferViews"][0]["buffer"] = 3; }},
      {"buffers[1].uri: found none, allowed: where the buffer's data is",
       [](GltfFile& f) {
         f.more_buffers = {{{"byteLength", 36}}};
         f.json["bufferViews"][0]["buffer"] = 1;
       }},
      {"buffers[1].uri: \"far away.bin\": no such file",
       [](GltfFile& f) {
         f.more_buffers = {{{"byteLength", 36}, {"uri", "far away.bin"}}};
         f.json["bufferViews"][0]["buffer"] = 1;
       }},
      {"buffers[1].byteLength: found 36, allowed: at most 3, the bytes of its data",
       [](GltfFile& f) {
         f.more_buffers = {{{"byteLength", 36}, {"uri", "data:application/octet-stream;base64,AAAA"}}};
         f.json["bufferViews"][0]["buffer"] = 1;
       }},
      {"buffers[1].uri: found a character that is not of base64, allowed: base64",
       [](GltfFile& f) {
         f.more_buffers = {{{"byteLength", 36}, {"uri", "data:application/octet-stream;base64,A A"}}};
         f.json["bufferViews"][0]["buffer"] = 1;
       }},
      {"buffers[1].uri: found no base64, allowed: \"data:...;base64,\"",
       [](GltfFile& f) {
         f.more_buffers = {{{"byteLength", 36}, {"uri", "data:,hello"}}};
         f.json["bufferViews"][0]["buffer"] = 1;
       }},
      {"buffers[1].uri: \".\": no such file",
       [](GltfFile& f) {
         f.more_buffers = {{{"byteLength", 36}, {"uri", "."}}};
         f.json["bufferViews"][0]["buffer"] = 1;
       }},
  });
}

TEST(GltfRefusals, Accessors) {
  const std::string attributes = "meshes[0].primitives[0].attributes.";
  expect_refusals({
      {"accessors[0].count: found 1000000000, allowed: an integer from 1 to 50000000",
       [](GltfFile& f) { f.json["accessors"][0]["count"] = 1'000'000'000; }},
      {"accessors[0]: found elements up to byte 120, allowed: the 36 bytes of its view",
       [](GltfFile& f) { f.json["accessors"][0]["count"] = 10; }},
      {"accessors[0].count: found -3, allowed: an integer from 1 to 50000000",
       [](GltfFile& f) { f.json["accessors"][0]["count"] = -3; }},
      {"accessors[0].count: found 40000000, allowed: at most 1000000 without a bufferView",
       [](GltfFile& f) {
         f.json["accessors"][0]["count"] = 40'000'000;
         f.json["accessors"][0].erase("bufferView");
       }},
      {"accessors[0].componentType: found 5130, allowed: 5120, 5121, 5122, 5123, 5125 or 5126",
       [](GltfFile& f) { f.json["accessors"][0]["componentType"] = 5130; }},
      {attributes + "POSITION: found SHORT, normalized, allowed: FLOAT (others with KHR_mesh_quantization)",
       [](GltfFile& f) {
         f.json["accessors"][0]["componentType"] = 5122;
         f.json["accessors"][0]["normalized"] = true;
       }},
      {attributes + "POSITION: found UNSIGNED_INT, allowed: BYTE; BYTE, normalized; UNSIGNED_BYTE; UNSIGNED_BYTE, "
                    "normalized; SHORT; SHORT, normalized; UNSIGNED_SHORT; UNSIGNED_SHORT, normalized; FLOAT",
       [](GltfFile& f) {
         f.json["accessors"][0]["componentType"] = 5125;
         f.json["extensionsUsed"] = {"KHR_mesh_quantization"};
       }},
      {attributes + "TEXCOORD_0: found 3 components, allowed: 2",
       [](GltfFile& f) { f.attributes()["TEXCOORD_0"] = 0; }},
      {attributes + "TEXCOORD_0: found 2 elements, allowed: 3, as of POSITION",
       [](GltfFile& f) { f.json["accessors"][1]["count"] = 2; }},
      {attributes + "POSITION: found 9, allowed: the number of one of 3 accessors",
       [](GltfFile& f) { f.attributes()["POSITION"] = 9; }},
      {"accessors[0].type: found \"MAT3\", allowed: SCALAR, VEC2, VEC3, VEC4 or MAT4 here",
       [](GltfFile& f) { f.json["accessors"][0]["type"] = "MAT3"; }},
      {"accessors[2]: found SHORT, allowed: scalars of UNSIGNED_BYTE, UNSIGNED_SHORT or UNSIGNED_INT as indices",
       [](GltfFile& f) { f.json["accessors"][2]["componentType"] = 5122; }},
      {"meshes[0].primitives[0].indices: found index 3, allowed: less than the 3 vertices",
       [](GltfFile& f) {
         f.primitive()["indices"] =
             f.add_accessor(bytes_of(std::vector<std::uint16_t>{0, 3, 2}), "SCALAR", 5123, 3, false);
       }},
      {"meshes[0].primitives[0].indices: found 2 indices, allowed: a multiple of 3",
       [](GltfFile& f) { f.json["accessors"][2]["count"] = 2; }},
      {"meshes[0].primitives[0].mode: found 9, allowed: an integer from 0 to 6",
       [](GltfFile& f) { f.primitive()["mode"] = 9; }},
      {"accessors[0].sparse.indices: found 200, allowed: less than the 3 elements",
       [](GltfFile& f) {
         f.json["accessors"][0]["sparse"] = {{"count", 1},
                                             {"indices", {{"bufferView", f.add_view("\xc8")}, {"componentType", 5121}}},
                                             {"values", {{"bufferView", f.add_view(std::string(12, 0))}}}};
       }},
      {"accessors[0].sparse.count: found 4, allowed: an integer from 1 to 3",
       [](GltfFile& f) {
         f.json["accessors"][0]["sparse"] = {{"count", 4}};
       }},
  });
}

TEST(GltfRefusals, PositionsThatAreNoNumbers) {
  GltfFile file;
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  file.attributes() = {{"POSITION", file.add({0, 0, 0, 1, 0, 0, 0, nan, 0, 0, 0, 0, infinity, 0, 0, 0, 1, 0}, "VEC3")}};
  EXPECT_EQ(refusal_of(file.gltf()), "found no triangles with an area, allowed: at least one");
}

TEST(GltfRefusals, Nodes) {
  expect_refusals({
      {"nodes[1].children[0]: found node 0 a second time, allowed: trees of nodes",
       [](GltfFile& f) {
         f.json["nodes"] = {{{"mesh", 0}, {"children", {1}}}, {{"children", {0}}}};
       }},
      {"nodes[0].children[0]: found node 0 a second time, allowed: trees of nodes",
       [](GltfFile& f) { f.json["nodes"][0]["children"] = {0}; }},
      {"nodes[0].children: found an array of 2, allowed: at most one reference to each node",
       [](GltfFile& f) {
         f.json["nodes"][0]["children"] = {0, 0};
       }},
      {"scenes[0].nodes[0]: found 5, allowed: the number of one of 1 nodes",
       [](GltfFile& f) { f.json["scenes"][0]["nodes"] = {5}; }},
      {"nodes[0].mesh: found -1, allowed: the number of one of 1 meshes",
       [](GltfFile& f) { f.json["nodes"][0]["mesh"] = -1; }},
      {"nodes[0].translation: found \"far\", allowed: an array",
       [](GltfFile& f) { f.json["nodes"][0]["translation"] = "far"; }},
      {"nodes[0].translation[1]: found 1e+300, allowed: a number from -1000000000 to 1000000000",
       [](GltfFile& f) {
         f.json["nodes"][0]["translation"] = {0, 1e300, 0};
       }},
      {"nodes[0].scale: found an array of 2, allowed: 3 numbers",
       [](GltfFile& f) {
         f.json["nodes"][0]["scale"] = {1, 1};
       }},
      {"nodes[0].rotation: found a quaternion of length 0, allowed: one of length 1",
       [](GltfFile& f) {
         f.json["nodes"][0]["rotation"] = {0, 0, 0, 0};
       }},
      {"nodes[0].matrix: found a projection, allowed: an affine matrix",
       [](GltfFile& f) { f.json["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }},
      {"nodes: found an array of 1000000, allowed: at most 100000 nodes",
       [](GltfFile& f) { f.json["nodes"] = nlohmann::json::array_t(1'000'000, nlohmann::json::object()); }},
  });
}

TEST(GltfRefusals, Materials) {
  const std::string pbr = "materials[0].pbrMetallicRoughness.";
  const auto texture = [](GltfFile& f) -> nlohmann::json& {
    return f.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  };
  expect_refusals({
      {"meshes[0].primitives[0].material: found 2, allowed: the number of one of 1 materials",
       [](GltfFile& f) { f.primitive()["material"] = 2; }},
      {pbr + "metallicFactor: found \"shiny\", allowed: a number from -1.7976931348623157e+308 to "
             "1.7976931348623157e+308",
       [](GltfFile& f) { f.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = "shiny"; }},
      {pbr + "baseColorTexture.index: found 4, allowed: the number of one of 1 textures",
       [&](GltfFile& f) { texture(f)["index"] = 4; }},
      {pbr + "baseColorTexture.texCoord: found -1, allowed: an integer from 0 to 255",
       [&](GltfFile& f) { texture(f)["texCoord"] = -1; }},
      {pbr + "baseColorTexture.extensions.KHR_texture_transform.offset[0]: found 1e+100, allowed: a number from "
             "-1000000 to 1000000",
       [&](GltfFile& f) {
         texture(f)["extensions"]["KHR_texture_transform"]["offset"] = {1e100, 0};
       }},
      {"textures[0].source: found 4, allowed: the number of one of 1 images",
       [](GltfFile& f) { f.json["textures"][0]["source"] = 4; }},
      {"textures[0].sampler: found 4, allowed: the number of one of 1 samplers",
       [](GltfFile& f) { f.json["textures"][0]["sampler"] = 4; }},
      {"samplers[0].wrapS: found 33069, allowed: 10497 (repeat), 33071 (clamp to edge) or 33648 (mirrored repeat)",
       [](GltfFile& f) { f.json["samplers"][0]["wrapS"] = 33069; }},
      {"materials[0].alphaMode: found \"SOLID\", allowed: OPAQUE, MASK or BLEND",
       [](GltfFile& f) { f.json["materials"][0]["alphaMode"] = "SOLID"; }},
      {"materials[0].extensions.KHR_materials_ior.ior: found 0.5, allowed: 0, or at least 1",
       [](GltfFile& f) { f.json["materials"][0]["extensions"]["KHR_materials_ior"]["ior"] = 0.5; }},
      {"materials[0].extensions.KHR_materials_volume.attenuationDistance: found 0, allowed: a number above 0",
       [](GltfFile& f) { f.json["materials"][0]["extensions"]["KHR_materials_volume"]["attenuationDistance"] = 0; }},
      {"materials[0].extensions.KHR_materials_emissive_strength.emissiveStrength: found -1, allowed: a number from 0 "
       "to 1.7976931348623157e+308",
       [](GltfFile& f) {
         f.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = -1;
       }},
  });
}

std::string png_header(std::uint32_t edge) {
  std::string bytes("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
  for (int k = 0; k < 2; ++k) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(edge >> shift);
  }
  return bytes + std::string("\x08\x02\0\0\0", 5) + "....";
}

TEST(GltfRefusals, Pictures) {
  const auto with_picture = [](const std::string& bytes) {
    return [bytes](GltfFile& f) { f.json["images"][0] = {{"uri", "data:image/png;base64," + to_base64(bytes)}}; };
  };
  expect_refusals({
      {"images[0].mimeType: found \"image/jpeg\", allowed: \"image/png\", as the picture's data are",
       [](GltfFile& f) { f.json["images"][0]["mimeType"] = "image/jpeg"; }},
      {"images[0]: found another format or a broken picture, allowed: PNG, JPEG or WebP", with_picture("GIF89a......")},
      {"images[0]: found 16384 x 16384 pixels, allowed: at most 8192 along an edge", with_picture(png_header(16384))},
      {"images[0]: found 4294967295 x 4294967295 pixels, allowed: at most 8192 along an edge",
       with_picture(png_header(0xffffffff))},
      {"images[0]: found a broken picture, allowed: one that can be decoded", with_picture(png_header(4))},
      {"images[0]: found a broken picture, allowed: one that can be decoded", with_picture(png_header(0))},
      {"images[0].bufferView: found none, allowed: the number of one of 3 bufferViews",
       [](GltfFile& f) {
         f.json["images"][0] = {{"mimeType", "image/png"}};
       }},
      {"images[0].uri: \"a.png\": no such file",
       [](GltfFile& f) {
         f.json["images"][0] = {{"uri", "a.png"}};
       }},
  });
  for (const char* extension : {".jpg", ".webp", ".png"}) {
    GltfFile file = sound();
    const std::string large = picture_bytes(extension, 9000, 4, {0, 0, 0});
    file.json["images"][0] = {{"bufferView", file.add_view(large)}};
    EXPECT_EQ(refusal_of(file.gltf()), "images[0]: found 9000 x 4 pixels, allowed: at most 8192 along an edge")
        << extension;
  }
}

// 100 000 instances of a mesh of 81 triangles are more than what is loaded, and are not tried.
TEST(GltfRefusals, MoreTrianglesThanAreLoaded) {
  GltfFile file = sound();
  std::vector<std::uint16_t> indices;
  for (int i = 0; i < 81; ++i) indices.insert(indices.end(), {0, 1, 2});
  file.primitive()["indices"] = file.add_accessor(bytes_of(indices), "SCALAR", 5123, 243, false);
  nlohmann::json::array_t nodes(100'000, file.json["nodes"][0]), roots;
  for (int i = 0; i < 100'000; ++i) roots.emplace_back(i);
  file.json["nodes"] = nodes;
  file.json["scenes"][0]["nodes"] = roots;
  EXPECT_EQ(refusal_of(file.gltf()), "meshes[0]: found more than 5000000 triangles up to here, allowed: as many");
}

// Each accessor is allowed, but not to read it again and again.
TEST(GltfRefusals, MoreElementsThanAreRead) {
  GltfFile file;
  file.json["accessors"][0].erase("bufferView");
  file.json["accessors"][0]["count"] = 1'000'000;
  file.attributes() = {{"POSITION", 0}, {"NORMAL", 0}};
  file.json["meshes"][0]["primitives"] = nlohmann::json::array_t(40, file.primitive());
  file.primitive()["mode"] = 5;
  for (auto& primitive : file.json["meshes"][0]["primitives"]) {
    primitive["mode"] = 5;
    primitive["indices"] = 1;
  }
  file.json["accessors"][1] = {{"count", 3}, {"componentType", 5121}, {"type", "SCALAR"}};
  EXPECT_EQ(refusal_of(file.gltf()),
            "accessors[0]: found 1000000 elements more, allowed: 50000000 of all accessors together");
}

}  // namespace
}  // namespace lumigraft::test
