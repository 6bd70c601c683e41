// Unlit objects: the camera sees their colour, all other light a matt surface.
#include <algorithm>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kUnlitColor = 0.6f, kUnlitWhite = 0.5f;

/// A ball under a lamp, with a material of its own.
ClosedScene ball_of(const relight::Material& material) {
  ClosedScene scene = ball_under_lamp();
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 40;
  scene.look_at_m = {0, 0, 0.12f};
  relight::VirtualObject& ball = scene.exhibit.objects[0];
  auto model = std::make_shared<relight::Model>(*ball.model);
  for (relight::Model::Part& part : model->parts) part.material = material;
  ball.model = model;
  ball.material = {};
  ball.white_radiance = kUnlitWhite;
  return scene;
}

relight::Material matt_material() {
  return {.base_color = Eigen::Vector3f::Constant(kUnlitColor), .specular = 0, .gltf = true};
}

ClosedScene unlit_ball() {
  relight::Material material = matt_material();
  material.unlit = true;
  return ball_of(material);
}

/// The room's change is that of a matt ball, exactly.
void expect_only_seen(const relight::RelitPicture& unlit, const relight::RelitPicture& lit, float tolerance = 0) {
  for (int v = 0; v < unlit.srgb.height; ++v) {
    for (int u = 0; u < unlit.srgb.width; ++u) {
      ASSERT_EQ(unlit.maps->mask.at(u, v), lit.maps->mask.at(u, v)) << u << ' ' << v;
      ASSERT_NEAR(unlit.maps->delta.at(u, v), lit.maps->delta.at(u, v), tolerance) << u << ' ' << v;
      if (unlit.maps->mask.at(u, v) == 1) {
        ASSERT_NEAR(picture_radiance(unlit, u, v), kUnlitWhite * kUnlitColor, 0.003) << u << ' ' << v;
      }
    }
  }
  EXPECT_EQ(unlit.maps->mask.at(unlit.srgb.width / 2, unlit.srgb.height / 2), 1);
}

TEST(RaysUnlit, TheCameraSeesTheColorAndTheRoomAMattBall) {
  const ClosedScene unlit = unlit_ball(), lit = ball_of(matt_material());
  relight::RayRenderer renderer(unlit.session()), other(lit.session());
  expect_only_seen(unlit.relit(renderer, rays_plan(4)), lit.relit(other, rays_plan(4)));
}

TEST(ReferenceUnlit, TheCameraSeesTheColorAndTheRoomAMattBall) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 4;
  ClosedScene unlit = unlit_ball(), lit = ball_of(matt_material());
  unlit.extent.min().head<2>().setConstant(-0.5f);
  unlit.extent.max().head<2>().setConstant(0.5f);
  lit.extent = unlit.extent;
  relight::ReferenceRenderer renderer(unlit.session()), other(lit.session());
  expect_only_seen(unlit.relit(renderer, plan), lit.relit(other, plan));
}

/// A polished metal slab below the ball, in whose image of the ball the picture's middle is.
ClosedScene with_mirror(ClosedScene scene, const relight::Material& material) {
  scene.exhibit.objects.push_back(box_object({-0.3f, -0.3f, 0.001f}, {0.3f, 0.3f, 0.01f}, 0));
  scene.exhibit.objects[1].material = material;
  scene.look_at_m = {0, -0.124f, 0.01f};
  return scene;
}

// At the point of the slab that mirrors the middle of the ball into the eye: they are 0.11 and 0.69 m above it.
TEST(RaysUnlit, AMirrorShowsTheColor) {
  relight::Material mirror{.base_color = {1, 1, 1}, .metallic = 1, .roughness = 0};
  const ClosedScene scene = with_mirror(unlit_ball(), mirror);
  relight::RayRenderer renderer(scene.session());
  EXPECT_NEAR(picture_radiance(scene.relit(renderer, rays_plan(8)), 24, 18), kUnlitWhite * kUnlitColor, 0.01);
}

TEST(ReferenceUnlit, AMirrorShowsTheColor) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 16;
  relight::Material mirror{.base_color = {1, 1, 1}, .metallic = 1, .roughness = 0};
  const ClosedScene scene = with_mirror(unlit_ball(), mirror);
  relight::ReferenceRenderer renderer(scene.session());
  EXPECT_NEAR(picture_radiance(scene.relit(renderer, plan), 24, 18), kUnlitWhite * kUnlitColor, 0.01);
}

class ClosedUnlit : public ClosedTest {};
ON_BOTH_DEVICES(ClosedUnlit);

TEST_P(ClosedUnlit, TheCameraSeesTheColorAndTheRoomAMattBall) {
  const ClosedScene unlit = unlit_ball(), lit = ball_of(matt_material());
  relight::Relighter relighter(device_, unlit.session());
  const relight::RelitPicture seen = unlit.relit(relighter, careful_plan(32, 1));
  expect_only_seen(seen, lit.relit(relighter, careful_plan(32, 1)), 1e-4f);
  EXPECT_NEAR(picture_radiance(unlit.relit(relighter, live_plan(32)), 24, 18), kUnlitWhite * kUnlitColor, 0.003);
}

// What is set of the way in which it treats light makes it lit.
TEST(UnlitMaterial, OverridesOfHowItReflectsMakeItLit) {
  relight::Material unlit = matt_material();
  unlit.unlit = true;
  relight::MaterialOverride material;
  EXPECT_TRUE(material.over(unlit).unlit);
  material.base_color = Eigen::Vector3f::Zero();
  EXPECT_TRUE(material.over(unlit).unlit) << "another colour";
  material.metallic = 1.0f;
  EXPECT_FALSE(material.over(unlit).unlit);
  EXPECT_FALSE(relight::MaterialOverride(relight::Material{}).over(unlit).unlit);
  EXPECT_FALSE(material.over(matt_material()).unlit);
}

}  // namespace
}  // namespace lumigraft::test
