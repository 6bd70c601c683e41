// Textures of metallic, roughness and normals in every renderer, against objects without textures that look the same;
// and the layer of glTF files against paths.
#include "relight/reference/reference_renderer.h"
#include "relight/tracing/microfacets.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

relight::TexturePicture texture(int width, const Bytes& rgb) {
  auto image = std::make_shared<capture::Image<std::uint8_t>>(width, 1, 3);
  image->data = rgb;
  return image;
}

const Points kTwoMaterials = box({-0.08f, -0.08f, 0.005f}, {0.08f, 0.08f, 0.15f});
const Points kMetalSides(kTwoMaterials.begin(), kTwoMaterials.begin() + 12),
    kClaySides(kTwoMaterials.begin() + 12, kTwoMaterials.end());

/// Two sides are of polished metal, the others of rough clay.
std::shared_ptr<relight::Model> block(bool textured) {
  const relight::Material metal{.base_color = {0.9f, 0.6f, 0.3f}, .metallic = 1, .roughness = 0.4f},
      clay{.base_color = {0.9f, 0.6f, 0.3f}, .metallic = 0, .roughness = 1};
  auto model = std::make_shared<relight::Model>();
  if (!textured) {
    add_part(model.get(), kMetalSides, metal);
    add_part(model.get(), kClaySides, clay);
    return model;
  }
  relight::Material mean = metal;
  mean.metallic = 0.5f;
  mean.roughness = 0.7f;
  // Texture coordinates with an area, at the texel's centre.
  std::vector<Eigen::Vector2f> texcoords;
  for (std::size_t i = 0; i < kTwoMaterials.size(); ++i) {
    const auto k = static_cast<float>(i % 3);
    texcoords.emplace_back((i < kMetalSides.size() ? 0.25f : 0.75f) + 1e-3f * k, 0.5f + 1e-3f * k * k);
  }
  add_part(model.get(), kTwoMaterials, mean, nullptr, texcoords);
  model->parts[0].metallic_roughness_texture.picture = texture(2, {0, 102, 255, 0, 255, 0});
  return model;
}

/// A plate whose normals are turned to one side, by a map or by its vertices. With a handedness, the map is in the
/// frame of the vertices' tangents, which are along y.
std::shared_ptr<relight::Model> plate(bool textured, float handedness = 0) {
  const Points corners{{-0.1f, -0.1f, 0.01f}, {0.1f, -0.1f, 0.01f}, {0.1f, 0.1f, 0.01f},
                       {-0.1f, -0.1f, 0.01f}, {0.1f, 0.1f, 0.01f},  {-0.1f, 0.1f, 0.01f}};
  std::vector<Eigen::Vector2f> texcoords;
  for (const Eigen::Vector3f& p : corners) texcoords.emplace_back(-p.x(), -p.y());  // mirrored
  auto model = std::make_shared<relight::Model>();
  add_part(model.get(), corners, {.base_color = {0.7f, 0.7f, 0.7f}, .roughness = 0.5f}, nullptr, texcoords);
  const Eigen::Vector3f map(55, 75, 0);
  const Eigen::Vector2f tilt = (map.head<2>() / 127.5f).array() - 1;
  const float up = std::sqrt(1 - tilt.squaredNorm());
  if (textured) {
    const auto z = static_cast<std::uint8_t>(std::lround(127.5f * (up + 1)));
    model->parts[0].normal_texture.picture = texture(1, {55, 75, z});
  } else {
    for (Eigen::Vector3f& n : model->normals) {
      n = handedness == 0 ? Eigen::Vector3f(-tilt.x(), tilt.y(), up)
                          : Eigen::Vector3f(-handedness * tilt.y(), tilt.x(), up);
    }
  }
  if (textured && handedness != 0) model->tangents.assign(model->normals.size(), {0, 1, 0, handedness});
  return model;
}

/// A plate with a picture of coloured squares and another of roughness and metal. Either these have a coordinate set, a
/// transform and wrap modes each, or all repeat, with the same squares written out.
std::shared_ptr<relight::Model> plate_with_slots(bool slots) {
  constexpr int kEdge = 4;
  const auto square = [](int u, int v) { return Eigen::Vector3i(40 + 60 * (u % 4), 250 - 50 * v, 60 * ((u + v) % 4)); };
  const auto squares = [&](int width, int height, const auto& place) {
    auto image = std::make_shared<capture::Image<std::uint8_t>>(width, height, 3);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const auto [x, y] = place(u, v);
        for (int c = 0; c < 3; ++c) image->at(u, v, c) = static_cast<std::uint8_t>(square(x, y)[c]);
      }
    }
    return image;
  };
  auto model = plate(false);
  model->normals.assign(model->normals.size(), Eigen::Vector3f::UnitZ());
  relight::Model::Part& part = model->parts[0];
  part.material = {
      .base_color = {0.9f, 0.9f, 0.9f}, .metallic = 1, .roughness = 0.6f, .emission = {0.1f, 0.05f, 0.02f}};
  model->texcoords.clear();
  for (const Eigen::Vector3f& p : model->positions_m) {
    // From -0.8 to 0.8 along both edges: within the centres of the texels that are written out.
    const Eigen::Vector2f at = 8 * p.head<2>();
    model->texcoords.push_back(slots ? Eigen::Vector2f(0.4f * at)
                                     : Eigen::Vector2f((at.x() + 1) / 2, (at.y() + 1) / 3));
    if (slots) model->texcoords_1.emplace_back(at.y(), at.x() - 3);
  }
  if (!slots) {
    // Two tiles along u, the first mirrored; three along v, of which two repeat the rows at the edges.
    part.base_color_texture.picture = squares(2 * kEdge, 3 * kEdge, [](int u, int v) {
      return std::pair(u < kEdge ? kEdge - 1 - u : u - kEdge, std::clamp(v - kEdge, 0, kEdge - 1));
    });
    part.metallic_roughness_texture = part.emissive_texture = part.base_color_texture;
    return model;
  }
  part.base_color_texture = {.picture = squares(kEdge, kEdge, [](int u, int v) { return std::pair(u, v); }),
                             .texcoord_set = 1,
                             .wrap_u = relight::Wrap::mirrored_repeat,
                             .wrap_v = relight::Wrap::clamp_to_edge};
  part.metallic_roughness_texture = part.base_color_texture;
  part.base_color_texture.transform << 0, 1, 3, 1, 0, 0;
  part.metallic_roughness_texture.texcoord_set = 0;
  part.metallic_roughness_texture.transform << 2.5f, 0, 0, 0, 2.5f, 0;
  part.emissive_texture = part.metallic_roughness_texture;
  return model;
}

class TexturedMaterials : public ClosedTest {
 protected:
  TexturedMaterials() {
    scene_.width = 64;
    scene_.height = 48;
    scene_.focal_px = 75;
    scene_.eye_m = {0.1f, -0.5f, 0.4f};
  }

  template <typename MakeRenderer>
  Bytes picture(std::shared_ptr<const relight::Model> model, const relight::Plan& plan, MakeRenderer make_renderer) {
    scene_.exhibit.objects.resize(1);
    scene_.exhibit.objects[0].model = std::move(model);
    const auto renderer = make_renderer();
    return scene_.relit(*renderer, plan).srgb.data;
  }

  /// RMS of the difference, in pixel values.
  static double apart(const Bytes& a, const Bytes& b) {
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(double(a[i]) - double(b[i]), 2);
    return std::sqrt(squares / static_cast<double>(a.size()));
  }

  template <typename MakeRenderer>
  void expect_as_without_textures(const relight::Plan& plan, MakeRenderer make_renderer, double turned_bound) {
    constexpr double kBound = 1;
    const auto drawn = [&](const std::shared_ptr<relight::Model>& model) {
      return picture(model, plan, make_renderer);
    };
    const Bytes with = drawn(block(true));
    auto mean = block(true);
    mean->parts[0].metallic_roughness_texture.picture = nullptr;
    const double without = apart(drawn(mean), with);
    EXPECT_GT(without, 5 * kBound) << "the scene shows no difference";
    EXPECT_LT(apart(drawn(block(false)), with), kBound);
    // Indirect light may be that of the interpolated normal. A lamp's is not.
    scene_.sky = 0;
    scene_.radiance = [](const Eigen::Vector3f&) { return 0.02f; };
    scene_.lamps = {lamp_at({0.3f, -0.3f, 0.6f}, 0.03f, 1)};
    const Bytes turned = drawn(plate(true));
    auto flat = plate(true);
    flat->parts[0].normal_texture.picture = nullptr;
    EXPECT_GT(apart(drawn(flat), turned), 2.5 * turned_bound) << "the scene shows no difference";
    EXPECT_LT(apart(drawn(plate(false)), turned), turned_bound);
    for (const float handedness : {1.0f, -1.0f})
      EXPECT_LT(apart(drawn(plate(false, handedness)), drawn(plate(true, handedness))), turned_bound) << handedness;
    const Bytes written_out = drawn(plate_with_slots(false));
    EXPECT_LT(apart(drawn(plate_with_slots(true)), written_out), kBound);
    auto other = plate_with_slots(true), emits_evenly = plate_with_slots(true);
    other->parts[0].base_color_texture.wrap_u = relight::Wrap::repeat;
    EXPECT_GT(apart(drawn(other), written_out), 5 * kBound) << "the scene shows no difference";
    emits_evenly->parts[0].emissive_texture.picture = nullptr;
    EXPECT_GT(apart(drawn(emits_evenly), written_out), 5 * kBound) << "the scene shows no difference";
  }

  /// A varnished ball, mixed as in glTF files, against one of paths.
  template <typename MakeRenderer>
  void expect_mixed_as_by_paths(const relight::Plan& plan, MakeRenderer make_renderer, double bound) {
    relight::Plan paths;
    paths.method = "reference";
    paths.samples = 256;
    const auto ball = [&](bool gltf) {
      auto model = std::make_shared<relight::Model>(*sphere_object(0.1f, {0, 0, 0}, 1).model);
      for (Eigen::Vector3f& p : model->positions_m) p.z() += 0.12f;
      model->parts[0].material = {{0.6f, 0.5f, 0.4f}, 0, 0.6f, 1, gltf};
      return model;
    };
    const Bytes reference =
        picture(ball(true), paths, [&] { return std::make_unique<relight::ReferenceRenderer>(scene_.session()); });
    const double right = apart(picture(ball(true), plan, make_renderer), reference);
    EXPECT_LT(right, bound);
    EXPECT_GT(apart(picture(ball(false), plan, make_renderer), reference), 1.25 * right)
        << "a layer that is passed twice";
  }

  ClosedScene scene_ = floor_under_lamp();
};
ON_BOTH_DEVICES(TexturedMaterials);

TEST_P(TexturedMaterials, ByCones) {
  expect_as_without_textures(
      careful_plan(32, 1), [&] { return std::make_unique<relight::Relighter>(device_, scene_.session()); }, 1);
}

TEST_P(TexturedMaterials, MixedAsInGltfByCones) {
  expect_mixed_as_by_paths(
      careful_plan(32, 1), [&] { return std::make_unique<relight::Relighter>(device_, scene_.session()); }, 3);
}

// Stripes that are wider than pixels, without specular reflection.
TEST_P(TexturedMaterials, EdgesWithinPixelsByCones) {
  auto striped = plate(true);
  relight::Model::Part& part = striped->parts[0];
  part.normal_texture.picture = nullptr;
  part.material = {.base_color = {1, 1, 1}, .specular = 0};
  Bytes stripes;
  for (int u = 0; u < 512; ++u) stripes.insert(stripes.end(), 3, u / 128 % 2 ? 255 : 0);
  part.base_color_texture.picture = texture(512, stripes);
  for (Eigen::Vector2f& uv : striped->texcoords) uv = 10 * (uv + Eigen::Vector2f(uv.y(), 0)) / 2;
  relight::Plan paths;
  paths.method = "reference";
  paths.samples = 256;
  const Bytes reference =
      picture(striped, paths, [&] { return std::make_unique<relight::ReferenceRenderer>(scene_.session()); });
  const double off = apart(picture(striped, careful_plan(32, 1),
                                   [&] { return std::make_unique<relight::Relighter>(device_, scene_.session()); }),
                           reference);
  EXPECT_LT(off, 4) << "5.8 where only the colour of the larger part of a pixel counts";
}

// Samples of a glTF file's plate and of another one's in one pixel are no metal.
TEST_P(TexturedMaterials, FilesOfBothKindsWithinAPixelByCones) {
  const auto plates = [&](bool left, bool right) {
    auto model = plate(false);
    model->normals.assign(model->normals.size(), Eigen::Vector3f::UnitZ());
    model->parts[0].material = {.base_color = {0.7f, 0.7f, 0.7f}, .roughness = 0.8f, .gltf = left};
    relight::Model::Part other = model->parts[0];
    other.material.gltf = right;
    other.first_index = 3;
    other.index_count = model->parts[0].index_count = 3;
    model->parts.push_back(other);
    return picture(model, careful_plan(32, 1),
                   [&] { return std::make_unique<relight::Relighter>(device_, scene_.session()); });
  };
  const Bytes gltf = plates(true, true), others = plates(false, false), both = plates(true, false);
  for (std::size_t i = 0; i < both.size(); ++i) {
    EXPECT_GE(both[i] + 4, std::min(gltf[i], others[i])) << i;
    EXPECT_LE(both[i], std::max(gltf[i], others[i]) + 4) << i;
  }
}

// A relief of waves of 3 mm, narrower than pixels, on a varnished plate: rough, as mip levels of its map say.
TEST_P(TexturedMaterials, AnUnresolvedReliefByCones) {
  constexpr int kEdge = 64;  // of a texture of 8 × 8 waves
  auto relief = std::make_shared<capture::Image<std::uint8_t>>(kEdge, kEdge, 3);
  const auto code = [](float x) { return static_cast<std::uint8_t>(std::lround(127.5f * (x + 1))); };
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      const auto slope = [](int at) { return 0.35f * std::sin(2 * relight::kPi * static_cast<float>(at) / 8); };
      const Eigen::Vector3f n = Eigen::Vector3f(slope(u), slope(v), 1).normalized();
      for (int c = 0; c < 3; ++c) relief->at(u, v, c) = code(n[c]);
    }
  }
  auto model = plate(true);
  model->parts[0].normal_texture.picture = relief;
  model->parts[0].material = {.base_color = {0.05f, 0.05f, 0.05f}, .roughness = 0.3f};
  for (Eigen::Vector2f& uv : model->texcoords) uv /= 0.024f;
  scene_.sky = 0;
  scene_.radiance = [](const Eigen::Vector3f&) { return 0.02f; };
  scene_.lamps = {lamp_at({0.0f, 0.4f, 0.45f}, 0.03f, 1)};  // reflected to the camera
  relight::Plan paths;
  paths.method = "reference";
  paths.samples = 256;
  const Bytes reference =
      picture(model, paths, [&] { return std::make_unique<relight::ReferenceRenderer>(scene_.session()); });
  const auto cones = [&](const std::shared_ptr<relight::Model>& drawn) {
    return picture(drawn, careful_plan(32, 1),
                   [&] { return std::make_unique<relight::Relighter>(device_, scene_.session()); });
  };
  auto smooth = std::make_shared<relight::Model>(*model);
  smooth->parts[0].normal_texture.picture = nullptr;
  // The slopes of waves are not distributed as those of GGX.
  EXPECT_LT(apart(cones(model), reference), apart(cones(smooth), reference) / 2);
}

class TexturedMaterialsByRays : public TexturedMaterials {};
INSTANTIATE_TEST_SUITE_P(On, TexturedMaterialsByRays, testing::Values(relight::gpu::Backend::vulkan),
                         relight::gpu::backend_label);

TEST_P(TexturedMaterialsByRays, ByRays) {
  expect_as_without_textures(
      rays_plan(1), [&] { return std::make_unique<relight::RayRenderer>(scene_.session()); }, 2);
}

TEST_P(TexturedMaterialsByRays, MixedAsInGltf) {
  expect_mixed_as_by_paths(
      rays_plan(1), [&] { return std::make_unique<relight::RayRenderer>(scene_.session()); }, 2);
}

TEST_P(TexturedMaterialsByRays, ByPaths) {
  relight::Plan paths;
  paths.method = "reference";
  paths.samples = 16;
  expect_as_without_textures(
      paths, [&] { return std::make_unique<relight::ReferenceRenderer>(scene_.session()); }, 1);
}

}  // namespace
}  // namespace lumigraft::test
