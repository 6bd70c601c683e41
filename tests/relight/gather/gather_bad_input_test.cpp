// Difficult scenes for ray tracing: no crash, no NaN or infinity, no spurious light.
#include <algorithm>
#include <cmath>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// A furnace: all radiances are equal, so an object that does not absorb is invisible.
ClosedScene furnace() {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 40;
  scene.albedo = 1;
  scene.sky = 0.5f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.5f; };
  return scene;
}

relight::RelitPicture relit(const ClosedScene& scene, int trace_scale = 2) {
  relight::RayRenderer renderer(scene.session());
  relight::RelitPicture picture = scene.relit(renderer, rays_plan(trace_scale, 20, 4));
  for (const capture::Image<float>* map : {&picture.maps->albedo, &picture.maps->normals, &picture.maps->depth_m,
                                           &picture.maps->delta, &picture.maps->mask}) {
    EXPECT_TRUE(std::all_of(map->data.begin(), map->data.end(), [](float x) { return std::isfinite(x); }));
  }
  return picture;
}

/// Largest relative deviation of a pixel from the furnace's light.
double off_the_furnace(const relight::RelitPicture& picture) {
  double max_off = 0;
  for (int v = 0; v < picture.srgb.height; ++v) {
    for (int u = 0; u < picture.srgb.width; ++u) {
      if (picture.maps->mask.at(u, v) == 0 && picture.maps->depth_m.at(u, v) <= 0) continue;  // beyond the room
      max_off = std::max(max_off, std::abs(picture_radiance(picture, u, v) / 0.5 - 1));
    }
  }
  return max_off;
}

TEST(RaysBadInput, APerfectMirrorOfRoughnessZeroIsInvisibleInAFurnace) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.12f, {0, 0, 0.15f}, 1)};
  scene.exhibit.objects[0].material = relight::Material{Eigen::Vector3f::Ones(), 1, 0, 1};
  for (const int trace_scale : {2, 8}) EXPECT_LT(off_the_furnace(relit(scene, trace_scale)), 0.1) << trace_scale;
}

TEST(RaysBadInput, AnObjectAroundTheCamera) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.2f, scene.eye_m, 1)};
  for (const int trace_scale : {2, 8}) relit(scene, trace_scale);
}

TEST(RaysBadInput, PicturesOfFewPixels) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 1}, {1, 5}, {9, 7}}) {
    ClosedScene scene = furnace();
    scene.width = width;
    scene.height = height;
    scene.focal_px = 8;
    scene.exhibit.objects = {sphere_object(0.12f, {0, 0, 0.15f}, 1)};
    for (const int trace_scale : {1, 2, 4, 8, 16}) {
      EXPECT_LT(off_the_furnace(relit(scene, trace_scale)), 0.1) << width << " x " << height << ", " << trace_scale;
    }
  }
}

TEST(RaysBadInput, ALampWithinAnObject) {
  ClosedScene scene = furnace();
  scene.lamps = {lamp_at({0, 0, 0.15f}, 0.01f, 0.1f)};
  scene.exhibit.objects = {sphere_object(0.12f, {0, 0, 0.15f}, 0.5f)};
  const relight::RelitPicture picture = relit(scene);
  // Lost to the floor is no more than all that lamp and sky bring it: I / (π d²) and 0.5.
  for (const float change : picture.maps->delta.data) EXPECT_GE(change, -0.1f / 3.14159f / (0.15f * 0.15f) - 0.5f);
}

TEST(RaysBadInput, AnObjectUnderTheFloorAndOneWithoutThickness) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, -0.3f}, 0.2f),
                           box_object({-0.1f, -0.1f, 0.1f}, {0.1f, 0.1f, 0.1f + 1e-6f}, 1)};
  for (const int trace_scale : {2, 8}) EXPECT_LT(off_the_furnace(relit(scene, trace_scale)), 0.1) << trace_scale;
}

TEST(RaysBadInput, WhatAModelLacksIsSaid) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 1)};
  auto model = std::make_shared<relight::Model>(*scene.exhibit.objects[0].model);
  model->unusable_triangles = 3;
  model->not_drawn = {"KHR_materials_iridescence (material \"veil\")", "cameras"};
  scene.exhibit.objects[0].model = model;
  const relight::RelitPicture picture = relit(scene);
  ASSERT_EQ(picture.warnings.size(), 2u);
  EXPECT_NE(picture.warnings[0].find("3 triangles without area or finite position"), std::string::npos);
  EXPECT_NE(picture.warnings[1].find(" is drawn without KHR_materials_iridescence (material \"veil\"), cameras"),
            std::string::npos);
}

TEST(RaysBadInput, RoomsWithoutColourOrLight) {
  ClosedScene scene = furnace();
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.5f)};
  reconstruct::Scene room = scene.scene();
  room.albedo = nullptr;
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture without = renderer.relight(scene.frame(), room, scene.exhibit, rays_plan(), true);
  EXPECT_FALSE(without.passed_through);
  for (const float change : without.maps->delta.data) EXPECT_EQ(change, 0);  // no change where the room is unknown
  room.illumination = nullptr;
  const relight::RelitPicture dark = renderer.relight(scene.frame(), room, scene.exhibit, rays_plan());
  EXPECT_TRUE(dark.passed_through);
  EXPECT_EQ(dark.warnings.size(), 1u);
}

}  // namespace
}  // namespace lumigraft::test
