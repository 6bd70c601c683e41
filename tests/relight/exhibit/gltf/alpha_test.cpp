// Alpha modes of glTF materials: what is opaque of a surface.
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;
using relight::Model;

constexpr double kDisc = std::numbers::pi * 0.2 * 0.2;

/// PNG, grey, whose alpha from 0 to 1 is a function of texture coordinates.
std::string alpha_png(int edge, const std::function<double(double u, double v)>& alpha) {
  capture::Image<std::uint8_t> picture(edge, edge, 4, 200);
  for (int y = 0; y < edge; ++y) {
    for (int x = 0; x < edge; ++x) {
      const double a = alpha((x + 0.5) / edge, (y + 0.5) / edge);
      picture.at(x, y, 3) = static_cast<std::uint8_t>(std::lround(255 * a));
    }
  }
  return png_bytes(picture);
}

/// Opaque in a disc of radius 0.2 around (0.3, 0.3), with an edge two texels wide.
std::string disc_png(int edge = 64) {
  return alpha_png(edge, [edge](double u, double v) {
    return std::clamp(0.5 + (0.2 - std::hypot(u - 0.3, v - 0.3)) * edge / 2, 0.0, 1.0);
  });
}

/// The triangle (0, 0), (1, 0), (0, 1), whose texture coordinates are its positions.
GltfFile masked(const std::string& png, const char* mode = "MASK") {
  GltfFile file;
  file.attributes()["TEXCOORD_0"] = file.add({0, 0, 1, 0, 0, 1}, "VEC2");
  file.json["images"] = {{{"uri", "data:image/png;base64," + to_base64(png)}}};
  file.json["textures"] = {{{"source", 0}}};
  file.json["materials"] = {{{"alphaMode", mode}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  file.primitive()["material"] = 0;
  return file;
}

nlohmann::json& alpha_material(GltfFile& file) { return file.json["materials"][0]; }

double area_of(const Model& model, const Model::Part& part) {
  double sum = 0;
  for (std::uint32_t i = part.first_index; i < part.first_index + part.index_count; i += 3) {
    const auto at = [&](std::uint32_t k) { return model.positions_m[model.indices[i + k]]; };
    sum += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).z();
  }
  return sum;
}
double area_of(const GltfFile& file) {
  const auto model = loaded(file.gltf());
  return area_of(*model, model->parts.at(0));
}

TEST(GltfAlpha, AMaskIsCutOutOfTheTriangles) {
  const auto model = loaded(masked(disc_png()).gltf());
  EXPECT_NEAR(area_of(*model, model->parts[0]), kDisc, 0.002);
  EXPECT_TRUE(model->not_drawn.empty());
  for (std::size_t v = 0; v < model->positions_m.size(); ++v) {
    EXPECT_LT((model->positions_m[v].head<2>() - model->texcoords[v]).norm(), 1e-5f);
    EXPECT_LT((model->positions_m[v].head<2>() - Eigen::Vector2f(0.3f, 0.3f)).norm(), 0.205f);
    EXPECT_LT((model->normals[v] - Vector3f::UnitZ()).norm(), 1e-5f);
  }
}

TEST(GltfAlpha, OpaqueMaterialsIgnoreAlpha) {
  EXPECT_NEAR(area_of(masked(disc_png(), "OPAQUE")), 0.5, 1e-6);
  EXPECT_NEAR(area_of(masked(picture_bytes(".png", 4, 4, {255, 0, 0}))), 0.5, 1e-6) << "a picture without alpha";
}

TEST(GltfAlpha, FactorAndCutoff) {
  // Alpha falls from 1 to 0 with u: it is the cutoff at u = 1 - cutoff / factor.
  GltfFile file = masked(alpha_png(256, [](double u, double) { return 1 - u; }));
  const auto expected = [](double u) { return u - u * u / 2; };
  EXPECT_NEAR(area_of(file), expected(0.5), 0.002);
  alpha_material(file)["alphaCutoff"] = 0.2;
  EXPECT_NEAR(area_of(file), expected(0.8), 0.002);
  alpha_material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.4};
  EXPECT_NEAR(area_of(file), expected(0.5), 0.002);
}

TEST(GltfAlpha, TransformAndWrapOfTheBaseColour) {
  GltfFile file = masked(disc_png(128));
  nlohmann::json& info = alpha_material(file)["pbrMetallicRoughness"]["baseColorTexture"];
  // A quarter of the size: the disc of 10 of the 16 tiles is in the triangle or cut by its edge.
  info["extensions"]["KHR_texture_transform"]["scale"] = {4, 4};
  const double all = area_of(file);
  EXPECT_NEAR(all, 0.5 * kDisc, 0.2 * kDisc);
  file.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33071}}};
  file.json["textures"][0]["sampler"] = 0;
  EXPECT_NEAR(area_of(file), kDisc / 16, 0.0005);
}

TEST(GltfAlpha, BlendIsPartialCoverageOfTheWholeSurface) {
  GltfFile file = masked(alpha_png(4, [](double u, double) { return u < 0.5 ? 0.2 : 1.0; }), "BLEND");
  alpha_material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.75};
  const auto model = loaded(file.gltf());
  EXPECT_TRUE(model->not_drawn.empty());
  const Model::Part& part = model->parts.at(0);
  EXPECT_NEAR(area_of(*model, part), 0.5, 1e-6);
  EXPECT_TRUE(part.blends());
  EXPECT_FLOAT_EQ(part.opacity_factor, 0.75f);
  ASSERT_NE(part.opacity_texture.picture, nullptr);
  EXPECT_EQ(part.opacity_texture.picture->at(0, 0, 0), 51);
  EXPECT_EQ(part.opacity_texture.picture->at(3, 0, 0), 255);
  EXPECT_EQ(model->blended, "material 0");
}

TEST(GltfAlpha, ForMethodsWithoutItBlendIsCutAtAHalf) {
  const auto model = loaded(masked(disc_png(), "BLEND").gltf());
  ASSERT_NE(model->cut, nullptr);
  EXPECT_NEAR(area_of(*model->cut, model->cut->parts[0]), kDisc, 0.002);
  EXPECT_FALSE(model->cut->parts[0].blends());
  EXPECT_EQ(loaded(masked(disc_png()).gltf())->cut, nullptr);
}

TEST(GltfAlpha, BlendWithoutTransparencyIsOpaque) {
  GltfFile file = masked(alpha_png(4, [](double, double) { return 1.0; }), "BLEND");
  for (const auto& model :
       {loaded(file.gltf()), loaded(masked(picture_bytes(".png", 4, 4, {255, 0, 0}), "BLEND").gltf())}) {
    EXPECT_FALSE(model->parts[0].blends());
    EXPECT_TRUE(model->blended.empty());
    EXPECT_EQ(model->cut, nullptr);
  }
}

TEST(GltfAlpha, WhereNothingWouldRemainAllRemains) {
  GltfFile file = masked(alpha_png(4, [](double, double) { return 0.2; }), "BLEND");
  EXPECT_NEAR(area_of(*loaded(file.gltf())->cut, loaded(file.gltf())->cut->parts[0]), 0.5, 1e-6) << "the whole model";
  file.json["materials"].push_back(nlohmann::json::object());
  nlohmann::json second = file.primitive();
  second["material"] = 1;
  file.json["meshes"][0]["primitives"].push_back(second);
  EXPECT_EQ(loaded(file.gltf())->cut->parts.size(), 1u) << "one of two materials";
  EXPECT_EQ(loaded(file.gltf())->parts.size(), 2u);
}

// What is too fine is followed coarsely: half of it remains, and no part is missing.
TEST(GltfAlpha, NoiseStaysBounded) {
  std::mt19937 random(1);
  GltfFile file = masked(alpha_png(1024, [&](double, double) { return random() % 2 ? 1.0 : 0.0; }));
  const auto model = loaded(file.gltf());
  EXPECT_LE(model->indices.size() / 3, 200'010u);
  EXPECT_NEAR(area_of(*model, model->parts[0]), 0.25, 0.1);
}

TEST(GltfAlpha, FarTextureCoordinatesAndManyTilesEnd) {
  GltfFile file = masked(disc_png(1024));
  nlohmann::json& transform =
      alpha_material(file)["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"];
  transform["scale"] = {900'000, 900'000};
  EXPECT_GE(area_of(file), 0.0);
  transform["scale"] = {1, 1};
  transform["offset"] = {500'000, 500'000};
  EXPECT_NEAR(area_of(file), kDisc, 0.3 * kDisc) << "texture coordinates there are a sixteenth apart";
}

// More triangles than a mask may add.
TEST(GltfAlpha, ALargeModelWithAnOpaqueMaskStaysWhole) {
  GltfFile file = masked(alpha_png(4, [](double, double) { return 1.0; }));
  std::vector<float> positions, texcoords;
  constexpr int kTriangles = 300'000;
  for (int i = 0; i < kTriangles; ++i) {
    const auto x = static_cast<float>(i % 1000), y = static_cast<float>(i / 1000);
    for (const auto& [dx, dy] : {std::pair{0.0f, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}}) {
      positions.insert(positions.end(), {x + dx, y + dy, 0});
      texcoords.insert(texcoords.end(), {dx, dy});
    }
  }
  file.attributes()["POSITION"] = file.add(positions, "VEC3");
  file.attributes()["TEXCOORD_0"] = file.add(texcoords, "VEC2");
  EXPECT_EQ(loaded(file.glb(), "a.glb")->indices.size(), 3u * kTriangles);
}

}  // namespace
}  // namespace lumigraft::test
