// Coated objects against closed forms, and devices and rays against the reference.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// Schlick's reflectance of the index 1.5.
double fresnel_at(double cosine) { return 0.04 + 0.96 * std::pow(1 - cosine, 5); }

/// A smooth coat over a matt plate below an even sky.
ClosedScene plate_under_sky(float base_color, float emission, const Eigen::Vector3f& eye_m) {
  ClosedScene scene;
  scene.width = 24;
  scene.height = 18;
  scene.focal_px = 60;
  scene.eye_m = eye_m;
  scene.look_at_m = {0, 0, 0.02f};
  scene.radiance = [](const Eigen::Vector3f&) { return 0.5f; };
  scene.exhibit.objects = {box_object({-0.3f, -0.3f, 0.001f}, {0.3f, 0.3f, 0.02f}, base_color)};
  relight::Material material{.base_color = Eigen::Vector3f::Constant(base_color), .specular = 0, .gltf = true};
  material.clearcoat = 1;
  material.emission.setConstant(emission);
  scene.exhibit.objects[0].material = material;
  return scene;
}

/// In the middle of the picture: the sky's light by the coat and, of the rest, what the base leaves of it and emits.
void expect_closed_form(const ClosedScene& scene, const relight::RelitPicture& picture, double tolerance) {
  const relight::MaterialOverride& material = scene.exhibit.objects[0].material;
  const int u = scene.width / 2, v = scene.height / 2;
  const Eigen::Vector3f to_eye = (scene.eye_m - scene.on_plane(u, v, scene.look_at_m.z())).normalized();
  const double share = fresnel_at(static_cast<double>(to_eye.z()));
  const double below = static_cast<double>((*material.base_color)[0] + (*material.emission)[0]);
  EXPECT_NEAR(picture_radiance(picture, u, v), share + (1 - share) * below, tolerance) << scene.eye_m.transpose();
}

std::vector<ClosedScene> plates() {
  std::vector<ClosedScene> all;
  for (const Eigen::Vector3f& eye_m : {Eigen::Vector3f(0, -0.4f, 0.9f), {0, -0.9f, 0.25f}}) {
    all.push_back(plate_under_sky(0, 0, eye_m));
    all.push_back(plate_under_sky(0.4f, 0.2f, eye_m));
  }
  return all;
}

/// A coat that is smoother than the metal below it, and one as rough as plastic, over a floor under a lamp and a sky.
ClosedScene coated_ball(float metallic, float coat_roughness) {
  ClosedScene scene = ball_under_lamp_and_sky();
  relight::Material material{.base_color = {0.7f, 0.7f, 0.7f}, .metallic = metallic, .roughness = 0.8f, .gltf = true};
  material.clearcoat = 1;
  material.clearcoat_roughness = coat_roughness;
  scene.exhibit.objects[0].material = material;
  return scene;
}

TEST(RaysCoat, APlateUnderAnEvenSky) {
  for (const ClosedScene& scene : plates()) {
    relight::RayRenderer renderer(scene.session());
    expect_closed_form(scene, scene.relit(renderer, rays_plan(2, 8)), 0.01);
  }
}

TEST(ReferenceCoat, APlateUnderAnEvenSky) {
  for (ClosedScene scene : plates()) {
    scene.extent.min().head<2>().setConstant(-0.5f);
    scene.extent.max().head<2>().setConstant(0.5f);
    expect_closed_form(scene, traced(scene, 32), 0.02);
  }
}

TEST(RaysCoat, AgreesWithTheReference) {
  for (const auto& [metallic, roughness] : {std::pair{1.0f, 0.1f}, {0.0f, 0.5f}}) {
    const ClosedScene scene = coated_ball(metallic, roughness);
    relight::RayRenderer renderer(scene.session());
    const double expected = mean_of_objects(traced(scene, 32));
    EXPECT_NEAR(mean_of_objects(scene.relit(renderer, rays_plan(2, 16))), expected, 0.02 * expected) << metallic;
  }
}

class ClosedCoat : public ClosedTest {};
ON_BOTH_DEVICES(ClosedCoat);

TEST_P(ClosedCoat, APlateUnderAnEvenSky) {
  relight::Relighter relighter(device_, plates()[0].session());
  for (const ClosedScene& scene : plates())
    expect_closed_form(scene, scene.relit(relighter, careful_plan(32, 1)), 0.02);
}

TEST_P(ClosedCoat, AgreesWithRays) {
  relight::Relighter relighter(device_, coated_ball(0, 0).session());
  for (const auto& [metallic, roughness] : {std::pair{1.0f, 0.1f}, {0.0f, 0.5f}}) {
    const ClosedScene scene = coated_ball(metallic, roughness);
    relight::RayRenderer renderer(scene.session());
    const double expected = mean_of_objects(scene.relit(renderer, rays_plan(2, 16)));
    EXPECT_NEAR(mean_of_objects(scene.relit(relighter, careful_plan(32, 1))), expected, 0.05 * expected) << metallic;
  }
}

// By textures of the model's own material, or by factors alone.
TEST_P(ClosedCoat, TexturesMultiplyIt) {
  const auto ball = [](bool textured) {
    ClosedScene scene = coated_ball(0, 0);
    relight::VirtualObject& object = scene.exhibit.objects[0];
    auto model = std::make_shared<relight::Model>(*object.model);
    for (relight::Model::Part& part : model->parts) {
      part.material = {.base_color = {0.1f, 0.1f, 0.1f}, .specular = 0, .gltf = true};
      part.material.clearcoat = 0.4f;
      part.material.clearcoat_roughness = 0.2f;
      if (!textured) continue;
      part.clearcoat_factor = 0.8f;
      part.clearcoat_roughness_factor = 1;
      auto both = std::make_shared<capture::Image<std::uint8_t>>(2, 2, 3);
      for (std::size_t i = 0; i < both->data.size(); i += 3) {
        both->data[i] = 128;
        both->data[i + 1] = 51;
      }
      part.clearcoat_texture.picture = part.clearcoat_roughness_texture.picture = both;
    }
    object.model = model;
    object.material = {};
    return scene;
  };
  relight::Relighter relighter(device_, ball(false).session());
  const relight::Plan plan = careful_plan(32, 1);
  const relight::RelitPicture textured = ball(true).relit(relighter, plan), plain = ball(false).relit(relighter, plan);
  for (std::size_t i = 0; i < plain.srgb.data.size(); ++i) ASSERT_NEAR(textured.srgb.data[i], plain.srgb.data[i], 1);
  ClosedScene none = ball(false);
  none.exhibit.objects[0].material.clearcoat = 0.0f;
  EXPECT_LT(mean_of_objects(none.relit(relighter, plan)), 0.95 * mean_of_objects(plain));
}

}  // namespace
}  // namespace lumigraft::test
