// Sheen, anisotropy and coats with normals of their own: rays and reference against closed forms and one another, and
// what devices make of them.
#include <algorithm>
#include <cmath>

#include "relight/exhibit/sheen.h"
#include "relight/tracing/bsdf.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// In the object's own material, which has more than an override can say.
void give_material(const relight::Material& material, relight::VirtualObject* object) {
  auto model = std::make_shared<relight::Model>(*object->model);
  for (relight::Model::Part& part : model->parts) {
    part.material = material;
    part.sheen_color_factor = material.sheen_color;
    part.anisotropy_factor = material.anisotropy;
    part.clearcoat_factor = material.clearcoat;
  }
  model->tangents.clear();  // around the vertical
  for (const Vector3f& n : model->normals) {
    const Vector3f around = Vector3f::UnitZ().cross(n);
    const Vector3f along = around.norm() > 1e-3f ? around.normalized() : Vector3f(1, 0, 0);
    model->tangents.emplace_back(along.x(), along.y(), along.z(), 1.0f);
  }
  object->model = model;
  object->material = {};
}

relight::Material velvet() {
  relight::Material material{.base_color = {0.3f, 0.2f, 0.1f}, .specular = 0, .gltf = true};
  material.sheen_color = {0.9f, 0.6f, 0.3f};
  material.sheen_roughness = 0.5f;
  return material;
}

relight::Material brushed_steel() {
  relight::Material material{.base_color = {0.7f, 0.7f, 0.7f}, .metallic = 1, .roughness = 0.45f, .gltf = true};
  material.anisotropy = 0.8f;
  material.anisotropy_rotation_rad = 0.4f;
  return material;
}

ClosedScene layered_ball(const relight::Material& material) {
  ClosedScene scene = ball_under_lamp_and_sky();
  give_material(material, &scene.exhibit.objects[0]);
  return scene;
}

/// RMS of the difference over that of the second, in channel 0 of the pixels that both show the object in.
double differing(const relight::RelitPicture& found, const relight::RelitPicture& wanted) {
  double off = 0, all = 0;
  for (int v = 0; v < wanted.srgb.height; ++v) {
    for (int u = 0; u < wanted.srgb.width; ++u) {
      if (wanted.maps->mask.at(u, v) < 1 || found.maps->mask.at(u, v) < 1) continue;
      const double expected = static_cast<double>(picture_radiance(wanted, u, v));
      off += std::pow(static_cast<double>(picture_radiance(found, u, v)) - expected, 2);
      all += expected * expected;
    }
  }
  return std::sqrt(off / all);
}

relight::RelitPicture gathered(const ClosedScene& scene) {
  relight::RayRenderer renderer(scene.session());
  return scene.relit(renderer, rays_plan(2, 16));
}

ClosedScene velvet_under_sky() {
  ClosedScene scene;
  scene.width = 24;
  scene.height = 18;
  scene.focal_px = 60;
  scene.eye_m = {0, -0.9f, 0.35f};
  scene.look_at_m = {0, 0, 0.02f};
  scene.radiance = [](const Vector3f&) { return 0.5f; };
  scene.extent.min().head<2>().setConstant(-0.5f);
  scene.extent.max().head<2>().setConstant(0.5f);
  scene.exhibit.objects = {box_object({-0.3f, -0.3f, 0.001f}, {0.3f, 0.3f, 0.02f}, 0.5f)};
  give_material(velvet(), &scene.exhibit.objects[0]);
  return scene;
}

/// Under an even sky: the albedo of the fibres, and what they leave of the base.
double expected_velvet(const ClosedScene& scene) {
  const Vector3f to_eye = (scene.eye_m - scene.on_plane(12, 9, 0.02f)).normalized();
  const relight::BsdfParams bsdf = relight::bsdf_params_of(velvet().base_color.array(), velvet());
  return static_cast<double>(bsdf.sheen[0] * relight::sheen_albedo(bsdf.sheen_alpha, to_eye.z()) +
                             relight::under_sheen_evenly(bsdf, to_eye.z()) * bsdf.diffuse[0]);
}

TEST(RaysLayers, VelvetUnderAnEvenSky) {
  const ClosedScene scene = velvet_under_sky();
  EXPECT_NEAR(mean_of_objects(gathered(scene)), expected_velvet(scene), 0.02);
}

TEST(ReferenceLayers, VelvetUnderAnEvenSky) {
  const ClosedScene scene = velvet_under_sky();
  EXPECT_NEAR(mean_of_objects(traced(scene, 32)), expected_velvet(scene), 0.02);
}

TEST(RaysLayers, AgreeWithTheReference) {
  for (const relight::Material& material : {velvet(), brushed_steel()}) {
    const ClosedScene scene = layered_ball(material);
    const relight::RelitPicture wanted = traced(scene, 64);
    const relight::RelitPicture found = gathered(scene);
    EXPECT_LT(differing(found, wanted), 0.1) << material.metallic;
    EXPECT_NEAR(mean_of_objects(found), mean_of_objects(wanted), 0.03 * mean_of_objects(wanted));
  }
}

/// A smooth coat over a black plate, whose normals lean towards the viewer.
ClosedScene leaning_coat_under_sky() {
  ClosedScene scene = velvet_under_sky();
  relight::Material material{.base_color = {0, 0, 0}, .specular = 0, .gltf = true};
  material.clearcoat = 1;
  relight::VirtualObject& object = scene.exhibit.objects[0];
  give_material(material, &object);
  auto model = std::make_shared<relight::Model>(*object.model);
  auto map = std::make_shared<capture::Image<std::uint8_t>>(1, 1, 3);
  map->data = {128, 77, 242};  // 0, -0.4, 0.9
  model->parts[0].clearcoat_normal_texture.picture = map;
  object.model = model;
  return scene;
}

/// Schlick's reflectance of the index 1.5, at the coat's normal.
double expected_coat(const ClosedScene& scene) {
  const Vector3f to_eye = (scene.eye_m - scene.on_plane(12, 9, 0.02f)).normalized();
  return 0.04 + 0.96 * std::pow(1 - static_cast<double>(to_eye.dot(Vector3f(0, -0.4f, 0.9f).normalized())), 5);
}

TEST(RaysLayers, ACoatWithNormalsOfItsOwn) {
  const ClosedScene scene = leaning_coat_under_sky();
  EXPECT_NEAR(picture_radiance(gathered(scene), 12, 9), expected_coat(scene), 0.005);
}

TEST(ReferenceLayers, ACoatWithNormalsOfItsOwn) {
  const ClosedScene scene = leaning_coat_under_sky();
  EXPECT_NEAR(picture_radiance(traced(scene, 32), 12, 9), expected_coat(scene), 0.005);
}

class ClosedLayers : public ClosedTest {};
ON_BOTH_DEVICES(ClosedLayers);

// Sheen is a matt colour and facets are equally wide in all directions: the energy is about the same, and both are
// said.
TEST_P(ClosedLayers, AreDrawnAsTheNearestThatDevicesHave) {
  relight::Relighter relighter(device_, layered_ball(velvet()).session());
  for (const relight::Material& material : {velvet(), brushed_steel()}) {
    const ClosedScene scene = layered_ball(material);
    const relight::RelitPicture picture = scene.relit(relighter, careful_plan(32, 1));
    const double expected = mean_of_objects(gathered(scene));
    EXPECT_NEAR(mean_of_objects(picture), expected, 0.1 * expected) << material.metallic;
    const std::string said = material.metallic > 0 ? "anisotropic roughness as" : "sheen as";
    EXPECT_TRUE(std::ranges::any_of(picture.warnings, [&](const std::string& line) {
      return line.find(said) != std::string::npos && line.find("plan.method = rays") != std::string::npos;
    }));
  }
}

}  // namespace
}  // namespace lumigraft::test
