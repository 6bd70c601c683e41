#include "relight/objects/model_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

std::uint8_t code(float x) { return static_cast<std::uint8_t>(std::lround(127.5f * (x + 1))); }

/// `at` gives the texel's three bytes.
template <typename Texel>
TexturePicture picture(int edge, Texel at) {
  auto image = std::make_shared<capture::Image<std::uint8_t>>(edge, edge, 3);
  for (int v = 0; v < edge; ++v) {
    for (int u = 0; u < edge; ++u) {
      const std::array<std::uint8_t, 3> texel = at(u, v);
      std::copy(texel.begin(), texel.end(), &image->at(u, v, 0));
    }
  }
  return image;
}

/// A square of a metre in the plane z = 0, with texture coordinates M · (x, y).
Model square(const Eigen::Matrix2f& M) {
  Model model;
  const test::Points corners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  std::vector<Vector2f> texcoords;
  for (const Vector3f& p : corners) texcoords.push_back(M * p.head<2>());
  test::add_part(&model, corners, {}, nullptr, texcoords);
  return model;
}

/// In the square's first triangle, x > y.
ModelPoint point_at(float x, float y, float footprint_m = 0) { return {0, {1 - x, x - y, y}, footprint_m}; }

/// u along x, v against y: as a picture that lies on the square, seen from above.
Eigen::Matrix2f lying() {
  Eigen::Matrix2f M;
  M << 1, 0, 0, -1;
  return M;
}

TEST(ModelSurface, RoughnessAndMetallicAtTheirTexel) {
  Model model = square(Eigen::Matrix2f::Identity());
  Model::Part& part = model.parts[0];
  part.metallic_factor = 0.9f;
  part.roughness_factor = 0.5f;
  part.metallic_roughness_texture.picture = picture(2, [](int u, int) {
    return u ? std::array<std::uint8_t, 3>{7, 255, 0} : std::array<std::uint8_t, 3>{99, 102, 255};
  });
  const ModelSurface surface(model, true);
  const Material left = surface.at(point_at(0.25f, 0.1f), {}).material,
                 right = surface.at(point_at(0.75f, 0.1f), {}).material;
  EXPECT_NEAR(left.roughness, 0.5f * 0.4f, 1e-5);
  EXPECT_NEAR(left.metallic, 0.9f, 1e-5);
  EXPECT_NEAR(right.roughness, 0.5f, 1e-5);
  EXPECT_NEAR(right.metallic, 0, 1e-5);

  MaterialOverride rough;
  rough.roughness = 0.7f;
  EXPECT_NEAR(surface.at(point_at(0.25f, 0.1f), rough).material.roughness, 0.7f, 1e-6);
  EXPECT_NEAR(surface.at(point_at(0.25f, 0.1f), rough).material.metallic, 0.9f, 1e-5);
  MaterialOverride metal;
  metal.metallic = 0.3f;
  EXPECT_NEAR(surface.at(point_at(0.25f, 0.1f), metal).material.metallic, 0.3f, 1e-6);
  EXPECT_NEAR(surface.at(point_at(0.25f, 0.1f), metal).material.roughness, 0.2f, 1e-5);
}

TEST(ModelSurface, TransmissionAtItsTexel) {
  Model model = square(Eigen::Matrix2f::Identity());
  Model::Part& part = model.parts[0];
  part.transmission_factor = 0.5f;
  part.material.transmission = 0.35f;
  part.transmission_texture.picture = picture(2, [](int u, int) {
    return u ? std::array<std::uint8_t, 3>{255, 7, 9} : std::array<std::uint8_t, 3>{102, 255, 255};
  });
  const ModelSurface surface(model, true);
  EXPECT_NEAR(surface.at(point_at(0.25f, 0.1f), {}).material.transmission, 0.2f, 1e-5);
  EXPECT_NEAR(surface.at(point_at(0.75f, 0.1f), {}).material.transmission, 0.5f, 1e-5);
  MaterialOverride clear;
  clear.transmission = 1.0f;
  EXPECT_EQ(surface.at(point_at(0.25f, 0.1f), clear).material.transmission, 1);
}

TEST(ModelSurface, ClearcoatAtItsTexel) {
  Model model = square(Eigen::Matrix2f::Identity());
  Model::Part& part = model.parts[0];
  part.clearcoat_factor = 0.5f;
  part.clearcoat_roughness_factor = 0.8f;
  part.clearcoat_texture.picture = part.clearcoat_roughness_texture.picture = picture(2, [](int u, int) {
    return u ? std::array<std::uint8_t, 3>{255, 102, 9} : std::array<std::uint8_t, 3>{51, 255, 255};
  });
  const ModelSurface surface(model, true);
  const Material left = surface.at(point_at(0.25f, 0.1f), {}).material,
                 right = surface.at(point_at(0.75f, 0.1f), {}).material;
  EXPECT_NEAR(left.clearcoat, 0.1f, 1e-5);
  EXPECT_NEAR(left.clearcoat_roughness, 0.8f, 1e-5);
  EXPECT_NEAR(right.clearcoat, 0.5f, 1e-5);
  EXPECT_NEAR(right.clearcoat_roughness, 0.32f, 1e-5);
  MaterialOverride matt;
  matt.clearcoat = 0.0f;
  EXPECT_EQ(surface.at(point_at(0.25f, 0.1f), matt).material.clearcoat, 0);
}

// The base keeps the normal of the geometry where only the coat has a map.
TEST(ModelSurface, TheCoatHasAMapOfItsOwn) {
  Model model = square(lying());
  Model::Part& part = model.parts[0];
  const Vector3f map(0.6f, 0, 0.8f);
  part.clearcoat_normal_texture.picture = picture(1, [&](int, int) {
    return std::array<std::uint8_t, 3>{code(map.x()), code(map.y()), code(map.z())};
  });
  part.material.clearcoat = 1;
  const ModelSurface::Shading s = ModelSurface(model, true).at(point_at(0.6f, 0.2f), {});
  EXPECT_LT((s.coat_normal - map).norm(), 0.01f);
  EXPECT_EQ(s.normal, Vector3f::UnitZ());
  part.material.clearcoat = 0;
  EXPECT_EQ(ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).coat_normal, Vector3f::UnitZ());
}

TEST(ModelSurface, SheenAndSpecularAtTheirTexel) {
  Model model = square(Eigen::Matrix2f::Identity());
  Model::Part& part = model.parts[0];
  part.sheen_color_factor = {0.5f, 1, 1};
  part.sheen_roughness_factor = 0.5f;
  part.specular_factor = 0.8f;
  part.specular_color_factor = {2, 1, 1};
  const auto white_and_black = picture(2, [](int u, int) {
    return u ? std::array<std::uint8_t, 3>{255, 255, 255} : std::array<std::uint8_t, 3>{0, 0, 0};
  });
  part.sheen_color_texture.picture = part.sheen_roughness_texture.picture = part.specular_texture.picture =
      part.specular_color_texture.picture = white_and_black;
  const ModelSurface surface(model, true);
  const Material left = surface.at(point_at(0.25f, 0.1f), {}).material,
                 right = surface.at(point_at(0.75f, 0.1f), {}).material;
  EXPECT_EQ(left.sheen_color, Vector3f::Zero());
  EXPECT_LT((right.sheen_color - Vector3f(0.5f, 1, 1)).norm(), 1e-5f);
  EXPECT_EQ(left.sheen_roughness, 0);
  EXPECT_NEAR(right.sheen_roughness, 0.5f, 1e-6);
  EXPECT_EQ(left.specular, 0);
  EXPECT_NEAR(right.specular, 0.8f, 1e-6);
  EXPECT_EQ(left.specular_color, Vector3f::Zero());
  EXPECT_LT((right.specular_color - Vector3f(2, 1, 1)).norm(), 1e-5f);
}

// The angle and the texture's direction add up, in the frame of the texture coordinates.
TEST(ModelSurface, DirectionOfAnisotropy) {
  Model model = square(lying());
  Model::Part& part = model.parts[0];
  part.material.anisotropy = part.anisotropy_factor = 0.5f;
  const auto along = [&] { return ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).rough_along; };
  EXPECT_LT((along() - Vector3f::UnitX()).norm(), 1e-5f);
  part.material.anisotropy_rotation_rad = 0.5f;
  EXPECT_LT((along() - Vector3f(std::cos(0.5f), std::sin(0.5f), 0)).norm(), 1e-5f);
  part.anisotropy_texture.picture = picture(1, [](int, int) { return std::array<std::uint8_t, 3>{128, 255, 204}; });
  EXPECT_LT((along() - Vector3f(-std::sin(0.5f), std::cos(0.5f), 0)).norm(), 0.01f);
  EXPECT_NEAR(ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).material.anisotropy, 0.4f, 1e-5);
  model.tangents.assign(model.positions_m.size(), Eigen::Vector4f(0, 1, 0, -1));  // instead of the texture's
  EXPECT_LT((along() - Vector3f(std::cos(0.5f), -std::sin(0.5f), 0)).norm(), 0.01f);
  model.tangents.clear();
  model.texcoords.assign(model.texcoords.size(), Vector2f(0, 0));
  EXPECT_EQ(ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).material.anisotropy, 0) << "no direction is known";
}

// x of the map goes along the texture's u and y against its v, also where the texture is turned or mirrored.
TEST(ModelSurface, NormalMapFollowsTheTexture) {
  const Vector3f map(0.3f, -0.5f, std::sqrt(1 - 0.34f));
  Eigen::Matrix2f turned, mirrored, stretched;
  turned << 0, 1, 1, 0;
  mirrored << -1, 0, 0, -1;
  stretched << 3, 0, 0, -0.2f;
  const struct {
    Eigen::Matrix2f M;
    Vector3f x, y;
  } cases[] = {{lying(), {1, 0, 0}, {0, 1, 0}},
               {turned, {0, 1, 0}, {-1, 0, 0}},
               {mirrored, {-1, 0, 0}, {0, 1, 0}},
               {stretched, {1, 0, 0}, {0, 1, 0}}};
  for (const auto& c : cases) {
    Model model = square(c.M);
    model.parts[0].normal_texture.picture = picture(2, [&](int, int) {
      return std::array<std::uint8_t, 3>{code(map.x()), code(map.y()), code(map.z())};
    });
    const Vector3f normal = ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).normal;
    EXPECT_LT((normal - (map.x() * c.x + map.y() * c.y + map.z() * Vector3f::UnitZ())).norm(), 0.01) << c.M;
    model.parts[0].normal_scale = 0;
    EXPECT_LT((ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).normal - Vector3f::UnitZ()).norm(), 1e-5);
  }
}

TEST(ModelSurface, NormalMapWithoutTextureCoordinatesChangesNothing) {
  Model model = square(Eigen::Matrix2f::Zero());
  model.parts[0].normal_texture.picture = picture(1, [](int, int) {
    return std::array<std::uint8_t, 3>{255, 128, 128};
  });
  EXPECT_EQ(ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).normal, Vector3f::UnitZ());
}

// Tangents of the vertices count before those of the texture, and their handedness decides on which side y is.
TEST(ModelSurface, NormalMapFollowsTheTangentsOfVertices) {
  const Vector3f map(0.3f, -0.5f, std::sqrt(1 - 0.34f));
  Model model = square(lying());
  model.parts[0].normal_texture.picture = picture(2, [&](int, int) {
    return std::array<std::uint8_t, 3>{code(map.x()), code(map.y()), code(map.z())};
  });
  for (const float handedness : {1.0f, -1.0f}) {
    // Not perpendicular to the normal, as interpolated ones are.
    const Vector3f along = Vector3f(0.6f, 0.8f, 0.3f).normalized();
    model.tangents.assign(6, {along.x(), along.y(), along.z(), handedness});
    const Vector3f x(0.6f, 0.8f, 0), y = handedness * Vector3f(-0.8f, 0.6f, 0);
    const Vector3f expected = map.x() * x + map.y() * y + map.z() * Vector3f::UnitZ();
    EXPECT_LT((ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).normal - expected).norm(), 0.01) << handedness;
  }
  model.tangents.assign(6, Eigen::Vector4f::Zero());
  EXPECT_LT((ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).normal - map).norm(), 0.01) << "the texture's";
}

// Without tangents of vertices, the map follows its own coordinates: the second set, turned by a quarter.
TEST(ModelSurface, NormalMapFollowsItsTransformedCoordinates) {
  const Vector3f map(0.3f, -0.5f, std::sqrt(1 - 0.34f));
  Model model = square(Eigen::Matrix2f::Zero());
  for (const Vector3f& p : model.positions_m) model.texcoords_1.emplace_back(p.x(), -p.y());
  Model::TextureSlot& slot = model.parts[0].normal_texture;
  slot.picture = picture(2, [&](int, int) {
    return std::array<std::uint8_t, 3>{code(map.x()), code(map.y()), code(map.z())};
  });
  slot.texcoord_set = 1;
  slot.transform << 0, -1, 0, 1, 0, 0;  // (u, v) to (-v, u): u along y, v along x
  const Vector3f expected(-map.y(), map.x(), map.z());
  EXPECT_LT((ModelSurface(model, true).at(point_at(0.6f, 0.2f), {}).normal - expected).norm(), 0.01);
}

// Each texture has its own coordinates, transform and wrap modes.
TEST(ModelSurface, TextureSlots) {
  Model model = square(Eigen::Matrix2f::Identity());
  for (const Vector3f& p : model.positions_m) model.texcoords_1.emplace_back(p.y(), p.x());
  const auto halves = picture(2, [](int u, int v) {
    return std::array<std::uint8_t, 3>{static_cast<std::uint8_t>(u ? 255 : 0), static_cast<std::uint8_t>(v ? 255 : 0),
                                       0};
  });
  Model::Part& part = model.parts[0];
  part.material = {.base_color = {1, 1, 1}, .emission = {2, 4, 8}};
  part.base_color_texture.picture = halves;
  part.base_color_texture.transform << 0.5f, 0, 0.5f, 0, 0.5f, 0;            // to (0.75, 0.05) at (0.5, 0.1)
  part.metallic_roughness_texture = {.picture = halves, .texcoord_set = 1};  // (0.1, 0.5)
  part.emissive_texture.picture = halves;
  part.emissive_texture.transform << 1, 0, 1.25f, 0, 1, 0.75f;  // (1.75, 0.85)
  part.emissive_texture.wrap_u = Wrap::mirrored_repeat;
  part.emissive_texture.wrap_v = Wrap::clamp_to_edge;
  const auto at = [&](float x, float y) { return ModelSurface(model, true).at(point_at(x, y), {}).material; };
  const Material m = at(0.5f, 0.1f);
  // Bilinear between (0.25) and (0.75): beyond their centres it repeats.
  EXPECT_NEAR(m.base_color.x(), 1, 1e-5);
  EXPECT_NEAR(m.base_color.y(), 0.4f, 1e-5) << "a tenth of a texture's edge above the first centre";
  EXPECT_NEAR(m.roughness, 0.5f, 1e-5) << "v of the second set is x";
  EXPECT_NEAR(m.emission.x(), 0, 1e-5) << "mirrored: as at 0.25";
  EXPECT_NEAR(m.emission.y(), 4, 1e-5) << "clamped beyond 0.75";

  MaterialOverride dark;
  dark.emission = Vector3f(1, 2, 3);
  EXPECT_EQ(ModelSurface(model, true).at(point_at(0.5f, 0.1f), dark).material.emission, Vector3f(1, 2, 3));
}

// A transform that shows a picture ten times as often makes footprints cover ten times as many texels.
TEST(ModelSurface, TransformsScaleFootprints) {
  Model model = square(lying());
  Model::TextureSlot& slot = model.parts[0].base_color_texture;
  slot.picture = picture(64, [](int u, int v) {
    const auto grey = static_cast<std::uint8_t>((u / 4 + v / 4) % 2 ? 255 : 0);
    return std::array<std::uint8_t, 3>{grey, grey, grey};
  });
  model.parts[0].material.base_color = {1, 1, 1};
  const auto spread = [&] {
    const ModelSurface surface(model, true);
    float low = 1, high = 0;
    for (float x = 0.3f; x < 0.8f; x += 0.003f) {
      const float value = surface.at(point_at(x, 0.21f, 0.02f), {}).material.base_color.x();
      low = std::min(low, value);
      high = std::max(high, value);
    }
    return high - low;
  };
  EXPECT_GT(spread(), 0.9f) << "squares of 6 cm, in a footprint of 2 cm";
  slot.transform *= 10;
  EXPECT_LT(spread(), 0.1f) << "squares of 6 mm";
}

// A relief of waves of which a footprint covers many has the slopes of a rough surface: α² is twice their variance.
TEST(ModelSurface, AnUnresolvedReliefIsRough) {
  constexpr int kEdge = 256;
  const double slope = 0.15;  // amplitude, along both axes
  const auto relief = [&](int u, int v) {
    const double x = slope * std::sin(2 * M_PI * u / 8), y = slope * std::sin(2 * M_PI * v / 8);
    const Vector3f n = Vector3f(static_cast<float>(x), static_cast<float>(y), 1).normalized();
    return std::array<std::uint8_t, 3>{code(n.x()), code(n.y()), code(n.z())};
  };
  Model model = square(lying());
  model.parts[0].normal_texture.picture = picture(kEdge, relief);
  model.parts[0].material.roughness = 0.3f;
  const ModelSurface surface(model, true);
  const auto far = surface.at(point_at(0.6f, 0.2f, 0.3f), {});
  EXPECT_LT((far.normal - Vector3f::UnitZ()).norm(), 0.01);
  const double variance = slope * slope / 2;  // of a sine, along each axis
  const double expected = std::sqrt(std::sqrt(std::pow(0.3, 4) + 2 * variance));
  EXPECT_NEAR(far.material.roughness, expected, 0.02 * expected);
  EXPECT_NEAR(surface.at(point_at(0.6f, 0.2f, 0), {}).material.roughness, 0.3f, 1e-4) << "resolved";
  EXPECT_NEAR(ModelSurface(model, false).at(point_at(0.6f, 0.2f, 0.3f), {}).material.roughness, 0.3f, 1e-4);
}

TEST(ModelSurface, PartsHaveTheirOwnTextures) {
  Model model = square(lying());
  test::add_part(&model, {{2, 0, 0}, {3, 0, 0}, {3, 1, 0}}, Material{.base_color = {0.5f, 0.5f, 0.5f}},
                 picture(1, [](int, int) {
                   return std::array<std::uint8_t, 3>{255, 0, 0};
                 }));
  const ModelSurface surface(model, true);
  EXPECT_EQ(surface.part(1), 0u);
  EXPECT_EQ(surface.part(2), 1u);
  EXPECT_LT(
      (surface.at({2, Vector3f::Constant(1 / 3.0f), 0.01f}, {}).material.base_color - Vector3f(0.5f, 0, 0)).norm(),
      1e-5);
  EXPECT_LT(
      (surface.at({0, Vector3f::Constant(1 / 3.0f), 0.01f}, {}).material.base_color - Material{}.base_color).norm(),
      1e-5);
}

}  // namespace
}  // namespace lumigraft::relight
