// Objects that emit light, by the reference, in rooms with a closed form.
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {
namespace {

constexpr float kFloorAlbedo = 0.6f, kObjectHeight_m = 0.8f;

relight::Material glowing(float radiance) {
  relight::Material material = lambert(0);
  material.emission.setConstant(radiance);
  return material;
}

relight::ReferenceScene floor_with(const relight::ReferenceMesh& object) {
  relight::ReferenceScene scene;
  scene.real = {square(5, 0, lambert(kFloorAlbedo))};
  scene.objects = {object};
  return scene;
}

/// Mean change of the floor at the origin.
double change_at_origin(const relight::ReferenceScene& scene) {
  const relight::PosedCamera camera = looking({0, -3, 0.4f}, {0, 0, 0}, 0.001f, 4, 4);
  return mean(tracer_of(scene).change(camera, samples_of(256)).change);
}

/// Faces down, its half edges being 0.3 m and 0.2 m.
relight::ReferenceMesh panel_above(const relight::Material& material) {
  relight::ReferenceMesh mesh = square(1, 0, material);
  mesh.T_tag_model = Eigen::Translation3f(0, 0, kObjectHeight_m) * Eigen::AngleAxisf(kPi, Eigen::Vector3f::UnitX()) *
                     Eigen::Scaling(0.3f, 0.2f, 0.7f);
  return mesh;
}

double form_factor_of_panel() {
  const double a = 0.3 / kObjectHeight_m, b = 0.2 / kObjectHeight_m;
  return 2 / std::numbers::pi *
         (a / std::hypot(1, a) * std::atan(b / std::hypot(1, a)) +
          b / std::hypot(1, b) * std::atan(a / std::hypot(1, b)));
}

TEST(ReferenceEmission, ABallLightsTheFloorAsItsSolidAngle) {
  const relight::ReferenceScene scene = floor_with(ball(0.1f, {0, 0, kObjectHeight_m}, glowing(20)));
  EXPECT_NEAR(change_at_origin(scene), kFloorAlbedo * 20 * std::pow(0.1 / kObjectHeight_m, 2), 0.003);
}

TEST(ReferenceEmission, APanelThatIsScaledUnevenlyLightsAsItsFormFactor) {
  EXPECT_NEAR(change_at_origin(floor_with(panel_above(glowing(4)))), kFloorAlbedo * 4 * form_factor_of_panel(), 0.003);
}

TEST(ReferenceEmission, TheBackOfASurfaceIsDark) {
  relight::ReferenceMesh mesh = panel_above(glowing(4));
  mesh.T_tag_model.linear() *= Eigen::AngleAxisf(kPi, Eigen::Vector3f::UnitX()).toRotationMatrix();
  EXPECT_NEAR(change_at_origin(floor_with(mesh)), 0, 1e-6);
}

TEST(ReferenceEmission, AnotherRadianceOfWhiteScalesIt) {
  relight::ReferenceMesh mesh = panel_above(glowing(4));
  mesh.white_radiance = 0.5f;
  EXPECT_NEAR(change_at_origin(floor_with(mesh)), kFloorAlbedo * 2 * form_factor_of_panel(), 0.002);
}

// White in one half and black in the other, interpolated in between: antisymmetric about a half, as seen from below the
// middle of the panel.
TEST(ReferenceEmission, ATextureDividesIt) {
  relight::ReferenceMesh mesh = panel_above(glowing(4));
  auto model = std::make_shared<relight::Model>(*mesh.model);
  for (std::size_t v = 0; v < model->positions_m.size(); ++v)
    model->texcoords[v] = (model->positions_m[v].head<2>().array() + 1) / 2;
  auto picture = std::make_shared<capture::Image<std::uint8_t>>(2, 1, 3);
  for (int c = 0; c < 3; ++c) picture->at(0, 0, c) = 255;
  model->parts[0].emissive_texture.picture = picture;
  mesh.model = model;
  EXPECT_NEAR(change_at_origin(floor_with(mesh)), kFloorAlbedo * 2 * form_factor_of_panel(), 0.003);
}

TEST(ReferenceEmission, RealSurfacesAndObjectsOccludeIt) {
  for (const bool real : {true, false}) {
    relight::ReferenceScene scene = floor_with(panel_above(glowing(4)));
    (real ? scene.real : scene.objects).push_back(square(0.6f, 0.7f, lambert(0)));
    EXPECT_NEAR(change_at_origin(scene), 0, 1e-6);
  }
}

TEST(ReferenceEmission, TheCameraSeesIt) {
  const relight::ReferenceScene scene = floor_with(ball(0.1f, {0, 0, kObjectHeight_m}, glowing(20)));
  const relight::PosedCamera camera = looking({0, -3, kObjectHeight_m}, {0, 0, kObjectHeight_m}, 0.001f, 4, 4);
  const relight::ReferencePicture picture = tracer_of(scene).change(camera, samples_of(16));
  EXPECT_NEAR(mean(picture.object), 20, 1e-4);
}

// A polished floor reflects the ball, whichever of both sampling strategies finds it.
TEST(ReferenceEmission, RoughMetalReflectsItWithoutCountingItTwice) {
  for (const float roughness : {0.05f, 0.5f, 1.0f}) {
    relight::ReferenceScene scene = floor_with(ball(0.1f, {0, 0, kObjectHeight_m}, glowing(20)));
    scene.real = {square(5, 0, metal(1, roughness))};
    const relight::PosedCamera camera = looking({0, -3, 0.4f}, {0, 0, 0}, 0.001f, 4, 4);
    const relight::DeltaPathTracer tracer = tracer_of(scene);
    relight::ReferenceScene lamp;
    lamp.real = scene.real;
    lamp.lamps = {bulb({0, 0, kObjectHeight_m}, 0.1f, 20)};
    const double as_lamp = mean(tracer_of(lamp).radiance(camera, samples_of(1024), false));
    EXPECT_NEAR(mean(tracer.change(camera, samples_of(1024)).change), as_lamp, 0.02 * as_lamp + 1e-4) << roughness;
    EXPECT_NEAR(mean(tracer.radiance(camera, samples_of(1024), true)), as_lamp, 0.02 * as_lamp + 1e-4) << roughness;
  }
}

}  // namespace
}  // namespace lumigraft::test
