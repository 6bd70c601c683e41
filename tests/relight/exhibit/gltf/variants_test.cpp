// Variants of the materials of glTF files.
#include "tests/relight/exhibit/gltf/gltf_models.h"
#include "tests/relight/exhibit/gltf/variant_files.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;
using relight::Model;

TEST(GltfVariants, EachHasItsMaterials) {
  GltfFile file = grey_red_or_blue();
  const auto model = loaded(file.gltf());
  ASSERT_EQ(model->variants.size(), 2u);
  EXPECT_EQ(model->variants[0].name, "red");
  EXPECT_EQ(model->variants[1].name, "blue");
  const auto color_of = [](const Model& of) { return of.parts.at(0).material.base_color; };
  EXPECT_EQ(color_of(*model), Vector3f(0.5f, 0.5f, 0.5f));
  EXPECT_EQ(color_of(*model->variants[0].model), Vector3f(1, 0, 0));
  EXPECT_EQ(color_of(*model->variants[1].model), Vector3f(0, 0, 1));
  for (const Model::Variant& variant : model->variants) {
    EXPECT_EQ(variant.model->positions_m, model->positions_m);
    EXPECT_TRUE(variant.model->variants.empty());
    EXPECT_TRUE(variant.model->not_drawn.empty());
  }
  EXPECT_TRUE(model->not_drawn.empty());
  file.json["extensionsRequired"] = {"KHR_materials_variants"};
  EXPECT_EQ(loaded(file.gltf())->variants.size(), 2u);
}

// A primitive without a mapping for a variant keeps its own material.
TEST(GltfVariants, WhereNothingIsMappedTheDefaultStays) {
  GltfFile file = grey_red_or_blue();
  nlohmann::json other = file.primitive();
  other.erase("extensions");
  file.json["meshes"][0]["primitives"].push_back(other);
  file.primitive()["extensions"]["KHR_materials_variants"]["mappings"].erase(1);
  const auto model = loaded(file.gltf());
  EXPECT_EQ(model->parts.size(), 1u);
  ASSERT_EQ(model->variants[0].model->parts.size(), 2u);
  EXPECT_EQ(model->variants[0].model->parts[0].material.base_color, Vector3f(0.5f, 0.5f, 0.5f));
  EXPECT_EQ(model->variants[0].model->parts[1].material.base_color, Vector3f(1, 0, 0));
  EXPECT_EQ(model->variants[1].model->parts.size(), 1u);
}

// What the geometry needs of textures is read for the materials of all variants.
TEST(GltfVariants, AMaskAndASecondSetOfTextureCoordinatesOfAVariant) {
  GltfFile file = grey_red_or_blue();
  file.attributes()["TEXCOORD_1"] = file.add({5, 6, 7, 8, 9, 10}, "VEC2");
  file.json["images"] = {{{"uri", "data:image/png;base64," + red_grey_png}}};
  file.json["textures"] = {{{"source", 0}}};
  nlohmann::json& blue = file.json["materials"][2];
  blue["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
  blue["pbrMetallicRoughness"]["baseColorFactor"] = {0, 0, 1, 0.25};
  blue["alphaMode"] = "MASK";
  nlohmann::json opaque = file.primitive();
  opaque.erase("extensions");
  file.json["meshes"][0]["primitives"].push_back(opaque);
  const auto model = loaded(file.gltf());
  EXPECT_EQ(model->indices.size(), 6u);
  EXPECT_TRUE(model->texcoords_1.empty());
  EXPECT_EQ(model->variants[0].model->indices.size(), 6u);
  EXPECT_EQ(model->variants[1].model->indices.size(), 3u) << "alpha is below the cutoff";
}

TEST(GltfVariants, NotDrawnAndBlendedIsWhatTheVariantAsksFor) {
  GltfFile file = grey_red_or_blue();
  file.json["materials"][1]["alphaMode"] = "BLEND";
  file.json["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.5};
  file.json["materials"][1]["extensions"]["KHR_materials_iridescence"]["iridescenceFactor"] = 1;
  const auto model = loaded(file.gltf());
  EXPECT_TRUE(model->not_drawn.empty());
  EXPECT_TRUE(model->blended.empty());
  EXPECT_EQ(model->variants[0].model->not_drawn, std::vector<std::string>{"KHR_materials_iridescence (material 1)"});
  EXPECT_EQ(model->variants[0].model->blended, "material 1");
}

TEST(GltfVariants, FaultsAreNamedWithTheirPlace) {
  GltfFile file = grey_red_or_blue();
  nlohmann::json& variants = file.json["extensions"]["KHR_materials_variants"]["variants"];
  variants[1] = {{"name", "red"}};
  EXPECT_EQ(refusal_of(file.gltf()),
            "extensions.KHR_materials_variants.variants[1].name: found \"red\", allowed: a name of its own for each "
            "variant");
  variants[1] = nlohmann::json::object();
  EXPECT_NE(refusal_of(file.gltf()).find("variants[1].name"), std::string::npos);
  variants = nlohmann::json::array();
  for (int i = 0; i <= 100; ++i) variants.push_back({{"name", std::to_string(i)}});
  EXPECT_NE(refusal_of(file.gltf()).find("found 101 variants, allowed: at most 100"), std::string::npos);
  file = grey_red_or_blue();
  file.primitive()["extensions"]["KHR_materials_variants"]["mappings"][0]["material"] = 7;
  EXPECT_NE(refusal_of(file.gltf()).find("mappings[0].material"), std::string::npos);
}

}  // namespace
}  // namespace lumigraft::test
