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
