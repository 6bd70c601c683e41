// Materials of glTF files: texture slots, specular reflection, emission, and what is not drawn.
#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "relight/exhibit/bsdf_params.h"
#include "relight/exhibit/picture_decode.h"
#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using relight::Model;
using relight::Wrap;

/// A triangle with a material whose every slot has a texture.
GltfFile with_textures() {
  GltfFile file;
  file.json["images"] = {{{"uri", "data:image/png;base64," + red_grey_png}},
                         {{"uri", "data:image/png;base64," + green_blue_png}}};
  file.json["textures"] = {{{"source", 0}}, {{"source", 1}}};
  file.json["materials"] = {
      {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 1}}}}},
       {"normalTexture", {{"index", 1}}},
       {"emissiveTexture", {{"index", 0}}},
       {"emissiveFactor", {1, 1, 1}}}};
  file.primitive()["material"] = 0;
  return file;
}

nlohmann::json& material(GltfFile& file) { return file.json["materials"][0]; }
nlohmann::json& base_color(GltfFile& file) { return material(file)["pbrMetallicRoughness"]["baseColorTexture"]; }

Model::Part part_of(const GltfFile& file) { return loaded(file.gltf())->parts.at(0); }

TEST(GltfMaterials, EverySlotHasItsOwnTextureCoordinates) {
  GltfFile file = with_textures();
  file.attributes()["TEXCOORD_1"] = file.add({5, 6, 7, 8, 9, 10}, "VEC2");
  EXPECT_TRUE(loaded(file.gltf())->texcoords_1.empty()) << "no texture reads it";
  material(file)["normalTexture"]["texCoord"] = 1;
  base_color(file)["extensions"]["KHR_texture_transform"]["texCoord"] = 1;  // overrides the own one
  const auto model = loaded(file.gltf());
  const Model::Part& part = model->parts[0];
  EXPECT_EQ(part.base_color_texture.texcoord_set, 1u);
  EXPECT_EQ(part.metallic_roughness_texture.texcoord_set, 0u);
  EXPECT_EQ(part.normal_texture.texcoord_set, 1u);
  EXPECT_EQ(part.emissive_texture.texcoord_set, 0u);
  ASSERT_EQ(model->texcoords_1.size(), 3u);
  EXPECT_EQ(model->texcoords_1[vertex_at(*model, {1, 0, 0})], Vector2f(7, 8));
  EXPECT_EQ(model->texcoords[vertex_at(*model, {1, 0, 0})], Vector2f(0.75f, 0.5f));
  EXPECT_TRUE(model->not_drawn.empty());
}

TEST(GltfMaterials, WrapModes) {
  GltfFile file = with_textures();
  const auto wraps = [&] {
    return std::pair(part_of(file).base_color_texture.wrap_u, part_of(file).base_color_texture.wrap_v);
  };
  EXPECT_EQ(wraps(), std::pair(Wrap::repeat, Wrap::repeat));
  file.json["samplers"] = {nlohmann::json::object()};
  file.json["textures"][0]["sampler"] = 0;
  EXPECT_EQ(wraps(), std::pair(Wrap::repeat, Wrap::repeat));
  file.json["samplers"][0] = {{"wrapS", 33071}, {"wrapT", 33648}};
  EXPECT_EQ(wraps(), std::pair(Wrap::clamp_to_edge, Wrap::mirrored_repeat));
  EXPECT_EQ(part_of(file).normal_texture.wrap_u, Wrap::repeat) << "another texture's";
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
}

// The second is the extension's example: the lower left quadrant of the picture, turned by 90°.
TEST(GltfMaterials, TextureTransform) {
  GltfFile file = with_textures();
  const auto transformed = [&](const nlohmann::json& extension, const Vector2f& uv) -> Vector2f {
    base_color(file)["extensions"]["KHR_texture_transform"] = extension;
    return part_of(file).base_color_texture.transform * uv.homogeneous();
  };
  EXPECT_LT((transformed({{"offset", {0.5, 0.125}}, {"scale", {2, 3}}}, {1, 1}) - Vector2f(2.5f, 3.125f)).norm(),
            1e-6f);
  const nlohmann::json quadrant = {{"offset", {0, 1}}, {"rotation", std::numbers::pi / 2}, {"scale", {0.5, 0.5}}};
  EXPECT_LT((transformed(quadrant, {0, 0}) - Vector2f(0, 1)).norm(), 1e-6f);
  EXPECT_LT((transformed(quadrant, {1, 0}) - Vector2f(0, 0.5f)).norm(), 1e-6f);
  EXPECT_LT((transformed(quadrant, {0, 1}) - Vector2f(0.5f, 1)).norm(), 1e-6f);
  EXPECT_LT((transformed(quadrant, {1, 1}) - Vector2f(0.5f, 0.5f)).norm(), 1e-6f);
  // The scale comes first.
  EXPECT_LT((transformed({{"rotation", std::numbers::pi / 2}, {"scale", {2, 1}}}, {1, 0}) - Vector2f(0, -2)).norm(),
            1e-6f);
  EXPECT_TRUE(part_of(file).emissive_texture.transform.isApprox(Eigen::Matrix<float, 2, 3>::Identity()));
}

TEST(GltfMaterials, TextureCoordinatesBeyondTheSecondSetAreNamed) {
  GltfFile file = with_textures();
  base_color(file)["texCoord"] = 2;
  const auto model = loaded(file.gltf());
  EXPECT_EQ(model->parts[0].base_color_texture.picture, nullptr);
  EXPECT_EQ(model->not_drawn, std::vector<std::string>{"TEXCOORD_2 (material 0)"});
}

TEST(GltfMaterials, EmissionIsFactorTimesStrength) {
  GltfFile file = with_textures();
  material(file)["emissiveFactor"] = {0.5, 0.25, 1};
  EXPECT_LT((part_of(file).material.emission - Vector3f(0.5f, 0.25f, 1)).norm(), 1e-6f);
  material(file)["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 8;
  const Model::Part part = part_of(file);
  EXPECT_LT((part.material.emission - Vector3f(4, 2, 8)).norm(), 1e-5f);
  ASSERT_NE(part.emissive_texture.picture, nullptr);
  EXPECT_EQ(part.emissive_texture.picture, part.base_color_texture.picture) << "decoded once";
  material(file).erase("emissiveFactor");
  EXPECT_EQ(part_of(file).material.emission, Vector3f::Zero());
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
}

// F0 = ((n - 1) / (n + 1))², and 0.04 is a specular factor of 1 of an opaque layer.
TEST(GltfMaterials, IndexOfRefraction) {
  GltfFile file = with_textures();
  EXPECT_EQ(part_of(file).material.layer_specular(), 1);
  auto& extensions = material(file)["extensions"];
  extensions["KHR_materials_ior"]["ior"] = 1.5;
  EXPECT_EQ(part_of(file).material.layer_specular(), 1);
  extensions["KHR_materials_ior"]["ior"] = 1.25;
  EXPECT_EQ(part_of(file).material.specular, 1);
  EXPECT_NEAR(part_of(file).material.layer_specular(), 1 / (81 * 0.04), 1e-6);
  extensions["KHR_materials_specular"]["specularFactor"] = 0.5;
  EXPECT_EQ(part_of(file).material.specular, 0.5f);
  EXPECT_NEAR(part_of(file).material.layer_specular(), 0.5 / (81 * 0.04), 1e-6);
  extensions["KHR_materials_ior"]["ior"] = 1;
  EXPECT_EQ(part_of(file).material.layer_specular(), 0);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  extensions["KHR_materials_ior"]["ior"] = 2.4;
  EXPECT_EQ(part_of(file).material.ior, 2.4f);
  EXPECT_EQ(part_of(file).material.layer_specular(), 1) << "more than a factor of 1 of devices";
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  extensions["KHR_materials_ior"]["ior"] = 0;  // total reflection
  EXPECT_EQ(part_of(file).material.layer_specular(), 0.5f);
  EXPECT_EQ(loaded(file.gltf())->not_drawn, std::vector<std::string>{"KHR_materials_ior (material 0)"});
}

// KHR_materials_specular: f0 = min(0.04 colour, 1) factor, f90 = factor.
TEST(GltfMaterials, SpecularFactorAndColour) {
  GltfFile file = with_textures();
  material(file)["pbrMetallicRoughness"]["metallicFactor"] = 0;
  auto& specular = material(file)["extensions"]["KHR_materials_specular"];
  specular = {{"specularFactor", 0.5}, {"specularColorFactor", {1, 0.5, 50}}};
  const Model::Part part = part_of(file);
  EXPECT_EQ(part.material.specular_color, Vector3f(1, 0.5f, 50));
  const relight::BsdfParams bsdf = relight::bsdf_params_of({0.1f, 0.1f, 0.1f}, part.material);
  EXPECT_LT((bsdf.f0 - Eigen::Array3f(0.02f, 0.01f, 0.5f)).abs().maxCoeff(), 1e-6f);
  EXPECT_EQ(bsdf.f90, 0.5f);
  specular["specularTexture"]["index"] = 0;       // without alpha: 1
  specular["specularColorTexture"]["index"] = 1;  // green and blue
  const Model::Part textured = part_of(file);
  EXPECT_EQ(textured.specular_texture.picture, nullptr);
  EXPECT_EQ(textured.material.specular, 0.5f);
  EXPECT_NE(textured.specular_color_texture.picture, nullptr);
  const float blue = 0.1329f / 2;  // of the sRGB value 102 and 0
  EXPECT_LT((textured.material.specular_color - Vector3f(0, 0.25f, 50 * blue)).norm(), 2e-3f);
  EXPECT_EQ(textured.specular_color_factor, Vector3f(1, 0.5f, 50));
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
}

TEST(GltfMaterials, Sheen) {
  GltfFile file = with_textures();
  EXPECT_EQ(part_of(file).material.sheen_color, Vector3f::Zero());
  capture::Image<std::uint8_t> with_alpha(2, 1, 4);
  with_alpha.data = {9, 9, 9, 255, 9, 9, 9, 51};
  file.json["images"].push_back({{"uri", "data:image/png;base64," + to_base64(png_bytes(with_alpha))}});
  file.json["textures"].push_back({{"source", 2}});
  material(file)["extensions"]["KHR_materials_sheen"] = {{"sheenColorFactor", {0.5, 0.25, 1}},
                                                         {"sheenRoughnessFactor", 0.5},
                                                         {"sheenColorTexture", {{"index", 1}}},
                                                         {"sheenRoughnessTexture", {{"index", 2}}}};
  const Model::Part part = part_of(file);
  EXPECT_EQ(part.sheen_color_factor, Vector3f(0.5f, 0.25f, 1));
  EXPECT_LT((part.material.sheen_color - Vector3f(0, 0.125f, 0.1329f / 2)).norm(), 1e-4f);
  ASSERT_NE(part.sheen_roughness_texture.picture, nullptr);
  EXPECT_EQ(part.sheen_roughness_texture.picture->data, (std::vector<std::uint8_t>{255, 255, 255, 51, 51, 51}));
  EXPECT_EQ(part.sheen_roughness_factor, 0.5f);
  EXPECT_NEAR(part.material.sheen_roughness, 0.5 * (1 + 0.2) / 2, 1e-5);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  relight::MaterialOverride red;
  red.base_color = Vector3f(1, 0, 0);
  EXPECT_EQ(red.over(part.material).sheen_color, Vector3f::Zero()) << "a base colour replaces it";
}

TEST(GltfMaterials, Anisotropy) {
  GltfFile file = with_textures();
  EXPECT_EQ(part_of(file).material.anisotropy, 0);
  material(file)["extensions"]["KHR_materials_anisotropy"] = {{"anisotropyStrength", 0.8},
                                                              {"anisotropyRotation", 1.5 + 4 * std::numbers::pi},
                                                              {"anisotropyTexture", {{"index", 1}}}};
  const Model::Part part = part_of(file);
  EXPECT_EQ(part.anisotropy_factor, 0.8f);
  EXPECT_NEAR(part.material.anisotropy_rotation_rad, 1.5, 1e-5);
  EXPECT_NE(part.anisotropy_texture.picture, nullptr);
  EXPECT_NEAR(part.material.anisotropy, 0.8 * 0.2, 1e-5) << "the mean of blue";
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  relight::MaterialOverride even;
  even.roughness = 0.5f;
  EXPECT_EQ(even.over(part.material).anisotropy, 0);
}

TEST(GltfMaterials, TransmissionAndVolume) {
  GltfFile file = with_textures();
  EXPECT_EQ(part_of(file).material.transmission, 0);
  EXPECT_FALSE(part_of(file).material.thin_walled) << "an override may make it a volume";
  auto& extensions = material(file)["extensions"];
  extensions["KHR_materials_transmission"]["transmissionFactor"] = 0.75;
  EXPECT_EQ(part_of(file).material.transmission, 0.75f);
  EXPECT_TRUE(part_of(file).material.thin_walled);
  extensions["KHR_materials_volume"] = {{"attenuationColor", {0.5, 0.25, 2}}, {"attenuationDistance", 0.1}};
  EXPECT_TRUE(part_of(file).material.thin_walled);
  extensions["KHR_materials_volume"]["thicknessFactor"] = 0.01;
  extensions["KHR_materials_ior"]["ior"] = 2.4;
  const relight::Material diamond = part_of(file).material;
  EXPECT_FALSE(diamond.thin_walled);
  EXPECT_EQ(diamond.ior, 2.4f);
  EXPECT_EQ(diamond.attenuation_color, Vector3f(0.5f, 0.25f, 1));
  EXPECT_EQ(diamond.attenuation_distance_m, 0.1f);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty()) << "a transmissive interface has the reflection of its index";
  extensions["KHR_materials_transmission"]["transmissionTexture"]["index"] = 0;  // red 1 and 188 / 255
  extensions["KHR_materials_volume"]["thicknessTexture"]["index"] = 0;           // the volume itself has a thickness
  const Model::Part textured = part_of(file);
  EXPECT_NE(textured.transmission_texture.picture, nullptr);
  EXPECT_EQ(textured.transmission_factor, 0.75f);
  EXPECT_NEAR(textured.material.transmission, 0.75 * (1 + 188 / 255.0) / 2, 1e-5);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  extensions["KHR_materials_transmission"]["transmissionTexture"]["texCoord"] = 2;
  EXPECT_EQ(loaded(file.gltf())->not_drawn, std::vector<std::string>{"TEXCOORD_2 (material 0)"});
}

TEST(GltfMaterials, Clearcoat) {
  GltfFile file = with_textures();
  EXPECT_EQ(part_of(file).material.clearcoat, 0);
  auto& coat = material(file)["extensions"]["KHR_materials_clearcoat"];
  coat = {{"clearcoatFactor", 0.75}, {"clearcoatRoughnessFactor", 0.5}};
  EXPECT_EQ(part_of(file).material.clearcoat, 0.75f);
  EXPECT_EQ(part_of(file).material.clearcoat_roughness, 0.5f);
  coat["clearcoatTexture"]["index"] = 0;           // red 1 and 188 / 255
  coat["clearcoatRoughnessTexture"]["index"] = 1;  // green 1 and 0
  const Model::Part textured = part_of(file);
  EXPECT_NE(textured.clearcoat_texture.picture, nullptr);
  EXPECT_NE(textured.clearcoat_roughness_texture.picture, nullptr);
  EXPECT_EQ(textured.clearcoat_factor, 0.75f);
  EXPECT_EQ(textured.clearcoat_roughness_factor, 0.5f);
  EXPECT_NEAR(textured.material.clearcoat, 0.75 * (1 + 188 / 255.0) / 2, 1e-5);
  EXPECT_NEAR(textured.material.clearcoat_roughness, 0.25, 1e-5);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  coat["clearcoatNormalTexture"] = {{"index", 0}, {"scale", 0.5}};
  EXPECT_NE(part_of(file).clearcoat_normal_texture.picture, nullptr);
  EXPECT_EQ(part_of(file).clearcoat_normal_scale, 0.5f);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
}

// Of an unlit material base colour and alpha count; all else is a fallback of the file's for other programs.
TEST(GltfMaterials, Unlit) {
  GltfFile file = with_textures();
  EXPECT_FALSE(part_of(file).material.unlit);
  material(file)["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
  material(file)["extensions"]["KHR_materials_sheen"] = nlohmann::json::object();
  material(file)["doubleSided"] = true;
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 0.25, 1, 1};
  const Model::Part part = part_of(file);
  EXPECT_TRUE(part.material.unlit);
  EXPECT_EQ(part.material.base_color, Vector3f(0.5f, 0.25f, 1));
  EXPECT_NE(part.base_color_texture.picture, nullptr);
  for (const Model::TextureSlot& slot : {part.metallic_roughness_texture, part.normal_texture, part.emissive_texture}) {
    EXPECT_EQ(slot.picture, nullptr);
  }
  EXPECT_EQ(part.material.emission, Vector3f::Zero());
  EXPECT_EQ(part.material.metallic, 0);
  EXPECT_EQ(part.material.specular, 0);
  file.json["extensionsRequired"] = {"KHR_materials_unlit"};
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  material(file)["alphaMode"] = "BLEND";
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.5};
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  EXPECT_EQ(loaded(file.gltf())->blended, "material 0");
}

TEST(GltfMaterials, PicturesInBufferViewsAndWebp) {
  GltfFile file = with_textures();
  constexpr std::array<std::uint8_t, 3> orange = {255, 128, 0};
  const int jpeg = file.add_view(picture_bytes(".jpg", 16, 8, orange)),
            webp = file.add_view(picture_bytes(".webp", 8, 4, orange));
  file.json["images"] = {{{"bufferView", jpeg}, {"mimeType", "image/jpeg"}},
                         {{"bufferView", webp}, {"mimeType", "image/webp"}},
                         {{"uri", "data:image/webp;base64," + to_base64(picture_bytes(".webp", 4, 4, orange))}}};
  file.json["extensionsUsed"] = {"EXT_texture_webp"};
  const auto near_orange = [](const relight::TexturePicture& picture) {
    const std::uint8_t* rgb = &picture->at(picture->width / 2, picture->height / 2, 0);
    return std::abs(rgb[0] - 255) < 12 && std::abs(rgb[1] - 128) < 12 && rgb[2] < 12;
  };
  for (const auto& bytes : {file.gltf(), file.glb()}) {
    const auto picture = loaded(bytes)->parts[0].base_color_texture.picture;
    EXPECT_EQ(picture->width, 16);
    EXPECT_TRUE(near_orange(picture));
  }
  for (const int width : {8, 4}) {
    file.json["textures"][0] = {{"source", 0},
                                {"extensions", {{"EXT_texture_webp", {{"source", width == 8 ? 1 : 2}}}}}};
    const auto picture = loaded(file.gltf())->parts[0].base_color_texture.picture;
    EXPECT_EQ(picture->width, width) << "WebP before the fallback";
    EXPECT_TRUE(near_orange(picture));
  }
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
}

TEST(GltfMaterials, PicturesInFormatsThatAreNotReadAreNamed) {
  GltfFile file = with_textures();
  file.json["textures"][0] = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
  const auto model = loaded(file.gltf());
  EXPECT_EQ(model->parts[0].base_color_texture.picture, nullptr);
  EXPECT_EQ(model->not_drawn, std::vector<std::string>{"KHR_texture_basisu (material 0)"});
}

TEST(GltfMaterials, WhatScenesAskForIsNamedOnce) {
  GltfFile file = with_textures();
  file.json["cameras"] = {{{"type", "perspective"}}};
  file.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
  file.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  material(file)["doubleSided"] = true;  // both sides are drawn always
  EXPECT_EQ(loaded(file.gltf())->not_drawn,
            (std::vector<std::string>{"emission of the back (material 0)", "KHR_lights_punctual", "cameras"}));
}

// Headers of broken files may state any size.
TEST(GltfMaterials, HalvingsOfAPicture) {
  EXPECT_EQ(relight::halvings(32, 32, 1024), 0);
  EXPECT_EQ(relight::halvings(33, 32, 1024), 1);
  EXPECT_EQ(relight::halvings(100, 1, 30), 2);
  EXPECT_EQ(relight::halvings(std::int64_t{1} << 32, std::int64_t{1} << 32, 1024), 27);
  EXPECT_EQ(relight::halvings(0, 0, 1), 0);
}

// Each of n pictures may have an nth of the texels of all; of a larger one each pixel is the mean of a square.
TEST(GltfMaterials, ManyLargePicturesAreScaledDown) {
  GltfFile file = with_textures();
  capture::Image<std::uint8_t> checker(512, 8, 3);
  for (int v = 0; v < checker.height; ++v) {
    for (int u = 0; u < checker.width; ++u)
      for (int c = 0; c < 3; ++c) checker.at(u, v, c) = (u + v) % 2 ? 200 : 100;
  }
  file.json["images"][0]["uri"] = "data:image/png;base64," + to_base64(png_bytes(checker));
  EXPECT_EQ(part_of(file).base_color_texture.picture->width, 512);
  EXPECT_TRUE(loaded(file.gltf())->not_drawn.empty());
  while (file.json["images"].size() < (1u << 16)) file.json["images"].push_back({{"uri", "absent.png"}});
  const auto model = loaded(file.gltf());  // 1024 texels each: 256 by 4
  const auto& picture = *model->parts[0].base_color_texture.picture;
  EXPECT_EQ(picture.width, 256);
  EXPECT_EQ(picture.height, 4);
  EXPECT_TRUE(std::ranges::all_of(picture.data, [](int value) { return value == 150; }));
  EXPECT_EQ(model->not_drawn,
            std::vector<std::string>{"the full size of 1 picture (scaled down to at most 1024 pixels each)"});
}

TEST(GltfMaterials, PartsAreInTheOrderOfMaterials) {
  GltfFile file = with_textures();
  file.json["materials"].push_back({{"pbrMetallicRoughness", {{"roughnessFactor", 0.5}}}});
  nlohmann::json second = file.primitive(), none = file.primitive();
  none.erase("material");
  file.primitive()["material"] = 1;
  second["material"] = 0;
  file.json["meshes"][0]["primitives"] = {none, file.primitive(), second};
  const auto model = loaded(file.gltf());
  ASSERT_EQ(model->parts.size(), 3u);
  EXPECT_NE(model->parts[0].base_color_texture.picture, nullptr);
  EXPECT_EQ(model->parts[1].material.roughness, 0.5f);
  EXPECT_EQ(model->parts[2].material.roughness, 1.0f);
  EXPECT_TRUE(model->parts[2].material.gltf);
}

}  // namespace
}  // namespace lumigraft::test
