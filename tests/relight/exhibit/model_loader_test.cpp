#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>

#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "relight/exhibit/exhibit.h"
#include "tests/relight/exhibit/model_files.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::relight {
namespace {

using test::GltfFile;
using test::TemporaryFolder;

::testing::AssertionResult near(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float tolerance = 1e-5f) {
  if ((a - b).cwiseAbs().maxCoeff() <= tolerance) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << a.transpose() << " is not " << b.transpose();
}

// The vertex of a model at a position; fails if there is none.
std::size_t vertex_at(const Model& model, const Eigen::Vector3f& p) {
  for (std::size_t v = 0; v < model.positions_m.size(); ++v) {
    if ((model.positions_m[v] - p).norm() < 1e-5f) return v;
  }
  ADD_FAILURE() << "no vertex at " << p.transpose();
  return 0;
}

void expect_sound(const Model& model) {
  ASSERT_EQ(model.indices.size() % 3, 0u);
  ASSERT_EQ(model.normals.size(), model.positions_m.size());
  ASSERT_EQ(model.texcoords.size(), model.positions_m.size());
  ASSERT_EQ(model.colors.size(), model.positions_m.size());
  std::uint32_t next = 0;
  for (const Model::Part& part : model.parts) {
    EXPECT_EQ(part.first_index, next);
    next += part.index_count;
  }
  EXPECT_EQ(next, model.indices.size());
  for (std::uint32_t i : model.indices) ASSERT_LT(i, model.positions_m.size());
  for (std::size_t v = 0; v < model.normals.size(); ++v) {
    ASSERT_TRUE(model.positions_m[v].allFinite());
    ASSERT_NEAR(model.normals[v].norm(), 1.0f, 1e-4f);
  }
}

std::string obj_of(const test::Points& corners) {
  std::string text;
  for (const Eigen::Vector3f& p : corners) {
    for (int a = 0; a < 3; ++a) text += (a == 0 ? "v " : " ") + std::to_string(p[a]);
    text += "\n";
  }
  for (std::size_t c = 1; c <= corners.size(); c += 3) {
    text += "f " + std::to_string(c) + " " + std::to_string(c + 1) + " " + std::to_string(c + 2) + "\n";
  }
  return text;
}

TEST(LoadModel, GltfAppliesNodesAndTurnsYUp) {
  TemporaryFolder folder;
  GltfFile file;
  // Parent: 90° about y, then 2 along x. Child: mirrored along x and twice as large.
  const float s = std::sqrt(0.5f);
  file.json["nodes"] = {{{"children", {1}}, {"translation", {2, 0, 0}}, {"rotation", {0, s, 0, s}}},
                        {{"mesh", 0}, {"scale", {-2, 2, 2}}}};
  const auto model = load_model(folder.write("a.gltf", file.gltf()), 'y');
  expect_sound(*model);
  ASSERT_EQ(model->positions_m.size(), 3u);
  // (1,0,0) scales to (-2,0,0), turns to (0,0,2), moves to (2,0,2); y up to z up: (2,-2,0).
  vertex_at(*model, {2, -2, 0});
  // (0,1,0) goes to (0,2,0), (2,2,0), (2,0,2).
  vertex_at(*model, {2, 0, 2});
  // The normal +z of the mesh stays +z when mirrored along x, turns to +x.
  EXPECT_TRUE(near(model->normals[0], {1, 0, 0}));
  // The winding agrees with the normal.
  const auto p = [&](int i) { return model->positions_m[model->indices[i]]; };
  EXPECT_GT((p(1) - p(0)).cross(p(2) - p(0)).dot(model->normals[0]), 0);
}

TEST(LoadModel, UpAxes) {
  TemporaryFolder folder;
  const auto path = folder.write("a.ply",
                                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                 "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                                 "end_header\n1 0 0\n0 2 0\n0 0 3\n3 0 1 2\n");
  vertex_at(*load_model(path, 'x'), {0, 0, 1});
  vertex_at(*load_model(path, 'x'), {2, 0, 0});
  vertex_at(*load_model(path, 'y'), {0, 0, 2});
  vertex_at(*load_model(path, 'y'), {0, -3, 0});
  vertex_at(*load_model(path, 'z'), {0, 0, 3});
  for (char up : {'x', 'y', 'z'}) {  // a rotation: the triangle's normal turns with it
    const auto model = load_model(path, up);
    const Eigen::Vector3f n = Eigen::Vector3f(6, 3, 2).normalized();
    const Eigen::Vector3f turned = up == 'x'   ? Eigen::Vector3f(n.y(), n.z(), n.x())
                                   : up == 'y' ? Eigen::Vector3f(n.x(), -n.z(), n.y())
                                               : n;
    EXPECT_TRUE(near(model->normals[0], turned)) << up;
  }
}

TEST(LoadModel, GltfMaterials) {
  TemporaryFolder folder;
  GltfFile file;
  file.json["materials"] = {
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.1, 0.2, 0.3, 1}}, {"metallicFactor", 0.4}, {"roughnessFactor", 0.6}}},
       {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0.25}}}}}}};
  file.json["extensionsUsed"] = {"KHR_materials_specular"};
  file.primitive()["material"] = 0;
  for (const auto& path : {folder.write("a.gltf", file.gltf()), folder.write("a.glb", file.glb())}) {
    const auto model = load_model(path, 'y');
    ASSERT_EQ(model->parts.size(), 1u);
    const Material& material = model->parts[0].material;
    EXPECT_TRUE(near(material.base_color, {0.1f, 0.2f, 0.3f}));
    EXPECT_FLOAT_EQ(material.metallic, 0.4f);
    EXPECT_FLOAT_EQ(material.roughness, 0.6f);
    EXPECT_FLOAT_EQ(material.specular, 0.25f);
    EXPECT_EQ(model->parts[0].base_color_texture.picture, nullptr);
  }
}

TEST(LoadModel, GltfWithoutMaterialHasTheDefaultsOfGltf) {
  TemporaryFolder folder;
  const auto model = load_model(folder.write("a.glb", GltfFile().glb()), 'y');
  EXPECT_TRUE(near(model->parts[0].material.base_color, {1, 1, 1}));
  EXPECT_FLOAT_EQ(model->parts[0].material.metallic, 1.0f);
  EXPECT_FLOAT_EQ(model->parts[0].material.roughness, 1.0f);
  EXPECT_FLOAT_EQ(model->parts[0].material.specular, 1.0f);
}

GltfFile textured(const std::string& uri) {
  GltfFile file;
  file.json["images"] = {{{"uri", uri}}, {{"uri", "data:image/png;base64," + test::green_blue_png}}};
  file.json["textures"] = {{{"source", 0}}, {{"source", 1}}};
  file.json["materials"] = {
      {{"pbrMetallicRoughness",
        {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 1}}}, {"roughnessFactor", 0.8}}},
       {"normalTexture", {{"index", 1}, {"scale", 0.7}}}}};
  file.primitive()["material"] = 0;
  return file;
}

TEST(LoadModel, GltfTexturesEmbeddedAndInFiles) {
  TemporaryFolder folder;
  folder.write("red grey.png", test::from_base64(test::red_grey_png));
  for (const std::string& uri : {"data:image/png;base64," + test::red_grey_png, std::string("red%20grey.png")}) {
    const auto model = load_model(folder.write("a.gltf", textured(uri).gltf()), 'y');
    const auto& texture = model->parts[0].base_color_texture.picture;
    ASSERT_NE(texture, nullptr);
    ASSERT_EQ(texture->width, 2);
    ASSERT_EQ(texture->height, 1);
    EXPECT_EQ(texture->data, (std::vector<std::uint8_t>{255, 0, 0, 188, 188, 188}));
    // v increases downwards, as in glTF, so coordinates are those of the file.
    EXPECT_NEAR(model->texcoords[vertex_at(*model, {1, 0, 0})].x(), 0.75f, 1e-6f);
    EXPECT_NEAR(model->texcoords[vertex_at(*model, {1, 0, 0})].y(), 0.5f, 1e-6f);
    EXPECT_NEAR(model->parts[0].material.roughness, 0.8f * 0.5f, 1e-6f);
    EXPECT_NEAR(model->parts[0].material.metallic, 0.2f, 1e-6f);
    const auto& both = model->parts[0].metallic_roughness_texture.picture;
    ASSERT_NE(both, nullptr);
    EXPECT_EQ(both->data, (std::vector<std::uint8_t>{0, 255, 0, 0, 0, 102}));
    EXPECT_FLOAT_EQ(model->parts[0].roughness_factor, 0.8f);
    EXPECT_FLOAT_EQ(model->parts[0].metallic_factor, 1.0f);
    EXPECT_EQ(model->parts[0].normal_texture.picture, both) << "decoded once";
    EXPECT_FLOAT_EQ(model->parts[0].normal_scale, 0.7f);
  }
}

// So its face has no vertices, at which assimp would end the program.
TEST(LoadModel, APlyWithAnUnknownTypeIsRefused) {
  TemporaryFolder folder;
  std::string ply =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty fl=at nz\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string position(12, '\0'), one("\x3f\x80\0\0", 4), zero(4, '\0'), color("\xc8\x64\x32", 3);
  const std::string normal = zero + zero + one + color;
  ply += position + normal + one + zero + zero + normal + zero + one + zero + normal;
  ply += std::string("\3\0\0\0\0\0\0\0\1\0\0\0\2", 13);
  EXPECT_THROW(load_model(folder.write("a.ply", ply), 'z'), capture::InputError);
}

TEST(LoadModel, APlyElementWithoutANumberIsRefused) {
  TemporaryFolder folder;
  const std::string ply = "ply\nformat ascii 1.0\nelement vertex float x\nproperty float y\nend_header\n0 0 0\n";
  EXPECT_THROW(load_model(folder.write("a.ply", ply), 'z'), capture::InputError);
}

TEST(LoadModel, WhatIsNotDrawnOfGltfIsNamed) {
  TemporaryFolder folder;
  GltfFile file = textured("data:image/png;base64," + test::red_grey_png);
  EXPECT_TRUE(load_model(folder.write("a.gltf", file.gltf()), 'y')->not_drawn.empty());
  file.json["cameras"] = {{{"type", "perspective"}}};
  auto& material = file.json["materials"][0];
  material["name"] = "lacquer\n";
  material["extensions"] = {{"KHR_materials_iridescence", {{"iridescenceFactor", 1}}},
                            {"KHR_materials_specular", {{"specularFactor", 0.5}}}};
  file.json["materials"].push_back(material);  // which no triangle has
  const auto model = load_model(folder.write("b.gltf", file.gltf()), 'y');
  EXPECT_EQ(model->not_drawn,
            (std::vector<std::string>{"KHR_materials_iridescence (material \"lacquer \")", "cameras"}));
  EXPECT_FLOAT_EQ(model->parts[0].material.specular, 0.5f);
}

// Their numbers in the file are not those of their first use.
TEST(LoadModel, GltfSpecularFactorsOfSeveralMaterials) {
  TemporaryFolder folder;
  GltfFile file;
  const auto with_specular = [](float factor, float red) {
    return nlohmann::json{{"pbrMetallicRoughness", {{"baseColorFactor", {red, 0, 0, 1}}}},
                          {"extensions", {{"KHR_materials_specular", {{"specularFactor", factor}}}}}};
  };
  file.json["materials"] = {with_specular(0.1f, 0.1f), with_specular(0.2f, 0.2f), with_specular(0.3f, 0.3f)};
  auto second = file.primitive();
  file.primitive()["material"] = 2;
  second["material"] = 0;
  file.json["meshes"][0]["primitives"].push_back(second);
  const auto model = load_model(folder.write("a.gltf", file.gltf()), 'y');
  ASSERT_EQ(model->parts.size(), 2u);
  for (const Model::Part& part : model->parts) EXPECT_NEAR(part.material.specular, part.material.base_color.x(), 1e-6f);
}

TEST(LoadModel, GltfWithWrongTypesIsNoCrash) {
  TemporaryFolder folder;
  for (const char* text :
       {R"({"asset":{"version":"2.0"},"meshes":3,"nodes":{"a":1},"materials":[7,null]})",
        R"({"scene":-1,"scenes":[{"nodes":[0,0,-5,"x"]}],"nodes":[{"children":[0],"mesh":9}]})", R"([1,2])", "", "{"}) {
    EXPECT_THROW(load_model(folder.write("a.gltf", text), 'y'), capture::InputError) << text;
  }
}

TEST(LoadModel, GltfVertexColorsAreLinear) {
  TemporaryFolder folder;
  GltfFile floats;
  floats.primitive()["attributes"]["COLOR_0"] = floats.add({0.5f, 0.25f, 1, 0.5f, 0.25f, 1, 0.5f, 0.25f, 1}, "VEC3");
  EXPECT_TRUE(near(load_model(folder.write("a.glb", floats.glb()), 'y')->colors[0], {0.5f, 0.25f, 1.0f}));
  GltfFile codes;
  const std::string rgba(12, '\x33');
  codes.primitive()["attributes"]["COLOR_0"] = codes.add_accessor(rgba, "VEC4", 5121, 3, true);
  EXPECT_TRUE(near(load_model(folder.write("b.glb", codes.glb()), 'y')->colors[0], {0.2f, 0.2f, 0.2f}));
}

TEST(LoadModel, PlyColorsOf8BitsAreSrgbAndFloatsLinear) {
  TemporaryFolder folder;
  const auto codes = load_model(
      folder.write("a.ply", test::ply_square("uchar", {"188 0 255", "188 0 255", "188 0 255", "188 0 255"})), 'z');
  expect_sound(*codes);
  EXPECT_EQ(codes->indices.size(), 6u);
  EXPECT_EQ(codes->positions_m.size(), 4u);
  EXPECT_TRUE(near(codes->colors[0], {capture::srgb_to_linear(188 / 255.0f), 0, 1}));
  EXPECT_TRUE(near(codes->parts[0].material.base_color, {1, 1, 1}));
  const auto floats =
      load_model(folder.write("b.ply", test::ply_square("float", {"0.5 0 1", "0.5 0 1", "0.5 0 1", "0.5 0 1"})), 'z');
  EXPECT_TRUE(near(floats->colors[0], {0.5f, 0, 1}));
  const auto plain = load_model(folder.write("c.ply", test::ply_square()), 'z');
  EXPECT_TRUE(near(plain->colors[0], {1, 1, 1}));
  EXPECT_TRUE(near(plain->parts[0].material.base_color, {0.8f, 0.8f, 0.8f}));
}

// -0.04f begins with the byte of a line end.
TEST(LoadModel, BinaryPlyWhateverItsFirstByte) {
  TemporaryFolder folder;
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const float x : {0.0f, -0.04f}) {
    SCOPED_TRACE(x);
    std::string bytes =
        header + test::bytes_of(std::vector<float>{x, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0, 2, 0, 1, 0, 0, 3, 4});
    bytes += '\3' + test::bytes_of(std::vector<std::int32_t>{0, 1, 2});
    const auto model = load_model(folder.write("a.ply", bytes), 'z');
    expect_sound(*model);
    EXPECT_TRUE(near(model->normals[vertex_at(*model, {x, 0, 0})], {0, 0, 1}));
    EXPECT_TRUE(near(model->normals[vertex_at(*model, {1, 0, 0})], {0, 0, 1}));
    EXPECT_TRUE(near(model->normals[vertex_at(*model, {0, 1, 0})], {0, 0.6f, 0.8f}));
  }
}

TEST(LoadModel, ObjMaterialsAndTexture) {
  TemporaryFolder folder;
  folder.write("red_grey.png", test::from_base64(test::red_grey_png));
  folder.write("a.mtl",
               "newmtl matt\nKd 0.1 0.2 0.3\nKs 0 0 0\nnewmtl glossy\nKd 0.5 0.5 0.5\nKs 0.02 0.02 0.02\nNs 30\n"
               "newmtl picture\nmap_Kd red_grey.png\nKs 0 0 0\n");
  const auto model = load_model(folder.write("a.obj",
                                             "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.9\n"
                                             "usemtl matt\nf 1 2 3\nusemtl glossy\nf 1 3 2\nusemtl picture\n"
                                             "f 1/1 2/1 3/1\n"),
                                'z');
  expect_sound(*model);
  ASSERT_EQ(model->parts.size(), 3u);
  const auto find = [&](float red) -> const Model::Part& {
    for (const Model::Part& part : model->parts) {
      if (std::abs(part.material.base_color.x() - red) < 1e-5f) return part;
    }
    ADD_FAILURE() << "no part of red " << red;
    return model->parts[0];
  };
  EXPECT_TRUE(near(find(0.1f).material.base_color, {0.1f, 0.2f, 0.3f}));
  EXPECT_FLOAT_EQ(find(0.1f).material.specular, 0.0f);
  EXPECT_FLOAT_EQ(find(0.5f).material.specular, 0.5f);
  EXPECT_NEAR(find(0.5f).material.roughness, 0.5f, 1e-5f);  // α² = 2/32 = 1/16, roughness = √(1/4)
  ASSERT_NE(find(1.0f).base_color_texture.picture, nullptr);
  EXPECT_EQ(find(1.0f).base_color_texture.picture->width, 2);
  const std::uint32_t v = model->indices[find(1.0f).first_index];
  EXPECT_NEAR(model->texcoords[v].y(), 0.1f, 1e-6f);  // v increases upwards in OBJ, downwards here
}

TEST(LoadModel, MissingNormalsAreSmoothOnSpheresAndSharpOnBoxes) {
  TemporaryFolder folder;
  const auto box = load_model(folder.write("box.obj", obj_of(test::box({-1, -2, -3}, {1, 2, 3}))), 'z');
  expect_sound(*box);
  EXPECT_EQ(box->positions_m.size(), 24u);  // vertices are merged within a face, not across its edges
  for (std::size_t v = 0; v < box->normals.size(); ++v) {
    EXPECT_NEAR(box->normals[v].cwiseAbs().maxCoeff(), 1.0f, 1e-6f);
    EXPECT_GT(box->normals[v].dot(box->positions_m[v]), 0);
  }
  const auto ball = load_model(folder.write("ball.obj", obj_of(test::sphere(0.5f, 24))), 'z');
  expect_sound(*ball);
  for (std::size_t v = 0; v < ball->normals.size(); ++v) {
    EXPECT_GT(ball->normals[v].dot(ball->positions_m[v].normalized()), std::cos(0.03f));
  }
  EXPECT_LT(ball->positions_m.size(), 24u * 48u);  // one vertex per position
}

TEST(LoadModel, TrianglesWithoutAreaAndWithNanAreDropped) {
  TemporaryFolder folder;
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n2 0 0\nnan 0 0\n";
  const auto model = load_model(folder.write("a.ply", head + "3 0 1 2\n3 0 1 3\n3 0 1 4\n3 1 1 2\n"), 'z');
  expect_sound(*model);
  EXPECT_EQ(model->indices.size(), 3u);
  EXPECT_EQ(model->positions_m.size(), 3u);
  EXPECT_EQ(model->unusable_triangles, 3u);
}

std::string error_of(const std::filesystem::path& path) {
  try {
    load_model(path, 'z');
  } catch (const capture::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(LoadModel, BadInputSaysWhatAndWhereInOneLine) {
  TemporaryFolder folder;
  const std::string square = test::ply_square();
  std::string truncated_binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 100\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 100\nproperty list uchar int vertex_indices\nend_header\n";
  truncated_binary += std::string(100, '\1');
  const std::string two_faces =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n";
  std::string quad_out_of_range = square;
  quad_out_of_range.replace(quad_out_of_range.find("4 0 1 2 3"), 9, "4 0 1 2 900000000");
  GltfFile no_picture = textured("missing.png");
  GltfFile broken_picture = textured("data:image/png;base64,AAAA");
  const std::string glb = GltfFile().glb();
  const std::vector<std::pair<std::filesystem::path, std::string>> cases = {
      {folder.path() / "missing.ply", "no such file"},
      {folder.write("empty.ply", ""), "not a model"},
      {folder.write("text.obj", "hello\n"), ""},
      {folder.write("model.stl", "solid\n"), "allowed: .gltf, .glb, .ply or .obj"},
      {folder.write("points.ply",
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                    "end_header\n0 0 0\n"),
       ""},
      {folder.write(
           "flat.ply",
           "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"),
       "no triangles"},
      {folder.write("cut.ply", square.substr(0, square.size() / 2)), ""},
      {folder.write("cut_header.ply", square.substr(0, 50)), "no end of the PLY header"},
      {folder.write("cut_faces.ply", two_faces.substr(0, two_faces.size() - 8)),
       "found 4 lines of data, allowed: the 5"},
      {folder.write("cut_binary.ply", truncated_binary), ""},
      {folder.write("range.ply", quad_out_of_range), ""},
      {folder.write("cut.glb", glb.substr(0, glb.size() / 2)), "not a model"},
      {folder.write("brackets.gltf", "{"), "not a model"},
      {folder.write("nothing.gltf", R"({"asset":{"version":"2.0"}})"), "scenes: found none, allowed: at least one"},
      {folder.write("no_picture.gltf", no_picture.gltf()), "images[0].uri: \"missing.png\": no such file"},
      {folder.write("broken_picture.gltf", broken_picture.gltf()), "a broken picture"},
  };
  for (const auto& [path, expected] : cases) {
    const std::string message = error_of(path);
    EXPECT_TRUE(message.starts_with(path.string() + ": ")) << path << " -> " << message;
    EXPECT_NE(message.find(expected), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(LoadModel, LargeModelsOfOthers) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  if (!extra) GTEST_SKIP() << "set LUMIGRAFT_EXTRA to the folder that holds sessions/ and data/ to run this";
  const std::filesystem::path root = extra;
  struct Case {
    const char* path;
    std::size_t triangles;
  };
  for (const Case& c : {Case{"sessions/tabletop/models/00.ply", 117584}, Case{"sessions/cornell/models/00.ply", 107808},
                        Case{"data/meshes/bunny.ply", 69451}, Case{"data/meshes/happy.obj", 20000},
                        Case{"data/meshes/armadillo.obj", 86482}, Case{"data/meshes/spot/spot.obj", 5856},
                        Case{"sessions/tabletop/truth/real_scene.ply", 92}}) {
    if (!std::filesystem::exists(root / c.path)) continue;
    const std::clock_t start = std::clock();
    const auto model = load_model(root / c.path, 'z');
    const double ms = 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    std::printf("%-42s %6zu triangles %6zu vertices %6.0f CPU ms\n", c.path, model->indices.size() / 3,
                model->positions_m.size(), ms);
    expect_sound(*model);
    EXPECT_EQ(model->indices.size() / 3, c.triangles);
    EXPECT_LT(model->positions_m.size(), model->indices.size() * 7 / 10);  // merged
  }
}

}  // namespace
}  // namespace lumigraft::relight
