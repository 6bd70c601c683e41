// Surfaces with partial coverage (alphaMode BLEND): what is seen through them, and what they leave of a lamp's light.
#include <algorithm>
#include <cmath>
#include <string>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kOpacity = 0.3f, kFurnace = 0.5f, kSheetColor = 0.9f;
constexpr float kSheet_m = 0.27f;  ///< height of the upright ones' middles

/// A square upright sheet that faces the camera, or a level one.
relight::VirtualObject sheet(const Eigen::Vector3f& middle_m, float half_m, bool upright, float color, float opacity) {
  relight::VirtualObject object = box_object({-1, -1, -1}, {1, 1, 1}, color);
  auto model = std::make_shared<relight::Model>(*object.model);
  model->positions_m.clear();
  model->normals.assign(4, upright ? Eigen::Vector3f(0, -1, 0) : Eigen::Vector3f(0, 0, 1));
  model->texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  model->colors.assign(4, Eigen::Vector3f::Ones());
  for (const Eigen::Vector2f& t : model->texcoords) {
    const Eigen::Vector2f at = half_m * (2 * t - Eigen::Vector2f::Ones());
    model->positions_m.push_back(middle_m +
                                 (upright ? Eigen::Vector3f(at.x(), 0, at.y()) : Eigen::Vector3f(at.x(), at.y(), 0)));
  }
  model->indices = {0, 1, 2, 0, 2, 3};
  model->parts.resize(1);
  relight::Model::Part& part = model->parts[0];
  part = {};
  part.material.base_color.setConstant(color);
  part.material.specular = 0;
  part.material.gltf = true;
  part.index_count = 6;
  part.opacity_factor = opacity;
  object.model = model;
  object.material = {};
  return object;
}

relight::VirtualObject unlit_sheet(float y_m, float color, float opacity) {
  relight::VirtualObject object = sheet({0, y_m, kSheet_m}, 0.25f, true, color, opacity);
  auto model = std::make_shared<relight::Model>(*object.model);
  model->parts[0].material.unlit = true;
  object.model = model;
  return object;
}

/// A white floor and sky of the same radiance.
ClosedScene furnace() {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 40;
  scene.albedo = 1;
  scene.sky = kFurnace;
  scene.radiance = [](const Eigen::Vector3f&) { return kFurnace; };
  scene.look_at_m = {0, 0, kSheet_m};
  return scene;
}

struct ByMethod {
  const char* method;
  int samples;
  relight::RelitPicture relit(const ClosedScene& scene) const {
    if (method == std::string("reference")) return traced(scene, samples);
    relight::RayRenderer renderer(scene.session());
    return scene.relit(renderer, rays_plan(1, 64));
  }
};

class Blended : public testing::TestWithParam<ByMethod> {};
INSTANTIATE_TEST_SUITE_P(Methods, Blended, testing::Values(ByMethod{"rays", 0}, ByMethod{"reference", 64}),
                         [](const auto& of) { return std::string(of.param.method); });

/// Means over the middle of the picture, where objects are: coverage, and radiance.
struct Middle {
  double coverage = 0, radiance = 0;
};
Middle middle_of(const relight::RelitPicture& picture) {
  Middle mean;
  const int width = picture.srgb.width, height = picture.srgb.height;
  int count = 0;
  for (int v = height / 2 - 4; v < height / 2 + 4; ++v) {
    for (int u = width / 2 - 4; u < width / 2 + 4; ++u, ++count) {
      mean.coverage += picture.maps->mask.at(u, v);
      mean.radiance += picture_radiance(picture, u, v);
    }
  }
  return {mean.coverage / count, mean.radiance / count};
}

TEST_P(Blended, AWhiteSheetIsInvisibleInAFurnace) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sheet({0, 0, kSheet_m}, 0.25f, true, 1, kOpacity)};
  const Middle middle = middle_of(GetParam().relit(scene));
  EXPECT_NEAR(middle.coverage, kOpacity, 0.02);
  EXPECT_NEAR(middle.radiance, kFurnace, 0.02 * kFurnace);
}

TEST_P(Blended, LayersAreSeenThroughEachOtherAndTheRoomThroughAll) {
  ClosedScene scene = furnace();
  scene.albedo = 0;  // its radiance is its own, which the sheets do not change
  scene.exhibit.objects = {unlit_sheet(0.1f, 1, 0.5f), unlit_sheet(-0.1f, 0.2f, kOpacity)};
  const Middle middle = middle_of(GetParam().relit(scene));
  EXPECT_NEAR(middle.coverage, 1 - 0.7 * 0.5, 0.02);
  EXPECT_NEAR(middle.radiance, 0.3 * 0.2 + 0.7 * (0.5 * 1 + 0.5 * kFurnace), 0.015);
}

TEST_P(Blended, AnOpaqueLayerBehindEndsThem) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {unlit_sheet(0.1f, 0.8f, 1), unlit_sheet(-0.1f, 0.2f, kOpacity)};
  const Middle middle = middle_of(GetParam().relit(scene));
  EXPECT_EQ(middle.coverage, 1);
  EXPECT_NEAR(middle.radiance, 0.3 * 0.2 + 0.7 * 0.8, 0.015);
}

/// A level sheet over a floor under one lamp.
ClosedScene floor_under_sheet(float color, float opacity) {
  ClosedScene scene = floor_under_lamp();
  scene.exhibit.objects = {sheet({0, 0, 0.15f}, 0.08f, false, color, opacity)};
  return scene;
}

/// Of the change of the floor where no object is seen: the sum, and how far it is from a factor times another's, RMS.
struct Shadows {
  double sum = 0, other = 0, off2 = 0, other2 = 0;
};
Shadows compared(const relight::RelitPicture& picture, const relight::RelitPicture& opaque) {
  Shadows s;
  for (int v = 0; v < picture.srgb.height; ++v) {
    for (int u = 0; u < picture.srgb.width; ++u) {
      if (opaque.maps->mask.at(u, v) > 0) continue;
      const double a = picture.maps->delta.at(u, v), b = opaque.maps->delta.at(u, v);
      s.sum += a;
      s.other += b;
      s.off2 += std::pow(a - kOpacity * b, 2);
      s.other2 += std::pow(kOpacity * b, 2);
    }
  }
  return s;
}

TEST_P(Blended, ShadowsTakeTheFractionOfAnOpaqueOnes) {
  const Shadows s =
      compared(GetParam().relit(floor_under_sheet(0, kOpacity)), GetParam().relit(floor_under_sheet(0, 1)));
  EXPECT_LT(s.other, -1);
  EXPECT_NEAR(s.sum / s.other, kOpacity, 0.01);
  EXPECT_LT(std::sqrt(s.off2 / s.other2), GetParam().samples ? 0.5 : 0.05);
}

// Two of them leave the product.
TEST_P(Blended, ShadowsOfLayersMultiply) {
  ClosedScene two = floor_under_sheet(0, 0.5f);
  two.exhibit.objects.push_back(sheet({0, 0, 0.13f}, 0.5f, false, 0, 0));
  two.exhibit.objects.push_back(sheet({0, 0, 0.14f}, 0.08f, false, 0, 0.5f));
  ClosedScene single = floor_under_sheet(0, 1);
  single.exhibit.objects.push_back(sheet({0, 0, 0.14f}, 0.08f, false, 0, 1));
  const Shadows s = compared(GetParam().relit(two), GetParam().relit(single));
  EXPECT_GT(s.sum / s.other, 0.70);
  EXPECT_LT(s.sum / s.other, 0.76);
}

TEST(RaysBlended, APictureIsTheSameAgain) {
  const ByMethod rays{"rays", 0};
  const ClosedScene scene = floor_under_sheet(kSheetColor, kOpacity);
  EXPECT_EQ(rays.relit(scene).srgb.data, rays.relit(scene).srgb.data);
}

// The left half is there, the right half is not.
TEST_P(Blended, ATextureDividesASheet) {
  ClosedScene scene = furnace();
  relight::VirtualObject object = unlit_sheet(0, 1, 0.8f);
  auto model = std::make_shared<relight::Model>(*object.model);
  auto alpha = std::make_shared<capture::Image<std::uint8_t>>(64, 1, 3);
  for (std::size_t i = 0; i < alpha->data.size() / 2; ++i) alpha->data[i] = 255;
  model->parts[0].opacity_texture.picture = alpha;
  model->parts[0].opacity_texture.wrap_u = relight::Wrap::clamp_to_edge;
  object.model = model;
  scene.exhibit.objects = {object};
  const relight::RelitPicture picture = GetParam().relit(scene);
  double left = 0, right = 0;
  for (int v = 14; v < 22; ++v) {
    for (int k = 2; k < 7; ++k) {
      left += picture.maps->mask.at(23 - k, v) / 40;
      right += picture.maps->mask.at(24 + k, v) / 40;
    }
  }
  EXPECT_NEAR(left, 0.8, 0.02);
  EXPECT_EQ(right, 0);
}

// Nothing but a sheet that emits over a black room's grey floor: its light is the fraction, too.
TEST_P(Blended, ItEmitsTheFraction) {
  const auto lit = [&](float opacity) {
    ClosedScene scene = furnace();
    scene.sky = 0;
    scene.albedo = 0.5f;
    scene.radiance = [](const Eigen::Vector3f&) { return 0.0f; };
    relight::VirtualObject object = sheet({0, 0, 0.15f}, 0.08f, false, 0, opacity);
    auto model = std::make_shared<relight::Model>(*object.model);
    std::swap(model->indices[1], model->indices[2]);
    std::swap(model->indices[4], model->indices[5]);
    for (Eigen::Vector3f& normal : model->normals) normal = -normal;
    model->parts[0].material.emission.setConstant(4);
    object.model = model;
    scene.exhibit.objects = {object};
    return GetParam().relit(scene);
  };
  const Shadows s = compared(lit(kOpacity), lit(1));
  EXPECT_GT(s.other, 1);
  EXPECT_NEAR(s.sum / s.other, kOpacity, 0.01);
}

class BlendedOnDevices : public ClosedTest {};
ON_BOTH_DEVICES(BlendedOnDevices);

TEST_P(BlendedOnDevices, ItIsCutAndNamedOnce) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sheet({0, 0, kSheet_m}, 0.25f, true, 1, kOpacity)};
  auto model = std::make_shared<relight::Model>(*scene.exhibit.objects[0].model);
  auto cut = std::make_shared<relight::Model>(*sheet({0, 0, kSheet_m}, 0.1f, true, 1, 1).model);
  model->blended = "material \"veil\"";
  model->cut = cut;
  scene.exhibit.objects[0].model = model;
  const relight::RelitPicture picture = relit(scene, coarse_plan());
  const auto named = [](const std::string& line) { return line.find("BLEND") != std::string::npos; };
  EXPECT_EQ(std::ranges::count_if(picture.warnings, named), 1);
  EXPECT_TRUE(std::ranges::any_of(picture.warnings, [](const std::string& line) {
    return line.find("is drawn with alphaMode BLEND cut at one half (material \"veil\")") != std::string::npos;
  }));
  double covered = 0;
  for (const float mask : picture.maps->mask.data) covered += mask;
  scene.exhibit.objects[0].model = cut;
  double of_cut = 0;
  const relight::RelitPicture of_cut_model = relit(scene, coarse_plan());
  for (const float mask : of_cut_model.maps->mask.data) of_cut += mask;
  EXPECT_GT(of_cut, 10);
  EXPECT_EQ(covered, of_cut);
}

}  // namespace
}  // namespace lumigraft::test
