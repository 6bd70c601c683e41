// Of a camera that moves, only tiles that objects or movement can change are traced.
#include "relight/gather/influence.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "relight/gather/moved_surfaces.h"
#include "relight/gather/ray_room.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;
using relight::GBufferPixel;
using relight::TileMask;

/// A scene in which the object changes the light of a part of the picture.
ClosedScene wide_floor() {
  ClosedScene scene = box_on_floor();
  scene.width = 320;
  scene.height = 236;  // not a multiple of a tile
  scene.focal_px = 200;
  return scene;
}

struct View {
  explicit View(const ClosedScene& scene)
      : room(scene.scene(), {}, {}),
        camera(scene.session().color.model),
        rays(camera),
        eye{rays, {camera, scene.T_tag_camera().cast<float>()}},
        radiance(camera.width, camera.height, 3) {
    for (std::size_t i = 0; i < radiance.data.size(); ++i)
      radiance.data[i] = 0.3f + 0.001f * static_cast<float>(i % 97);
  }
  std::vector<GBufferPixel> traced(const TileMask& tiles, std::vector<GBufferPixel> seen = {}) const {
    trace_room(room, eye, radiance, tiles, seen);
    return seen;
  }
  TileMask all() const { return {camera.width, camera.height, true}; }

  relight::RayRoom room;
  capture::CameraModel camera;
  relight::PixelRays rays;
  relight::CameraRays eye;
  capture::Image<float> radiance;
};

void expect_same(const GBufferPixel& a, const GBufferPixel& b) {
  EXPECT_EQ(a.known, b.known);
  EXPECT_EQ(a.w, b.w);
  EXPECT_EQ(a.depth_m, b.depth_m);
  EXPECT_EQ(a.surface.position_m, b.surface.position_m);
  EXPECT_EQ(a.surface.normal, b.surface.normal);
  EXPECT_TRUE((a.albedo == b.albedo).all());
  EXPECT_TRUE((a.before == b.before).all());
}

TEST(TracedTiles, HaveThePixelsOfTheWholePictureAndTheOthersNone) {
  const View view(wide_floor());
  const std::vector<GBufferPixel> whole = view.traced(view.all());
  TileMask some(view.camera.width, view.camera.height, false);
  for (int k = 0; k < 500; k += 3) some.set(k * 7 % some.across(), k % some.down());
  const std::vector<GBufferPixel> part = view.traced(some, whole);  // what was traced before is gone
  for (int v = 0; v < view.camera.height; ++v) {
    for (int u = 0; u < view.camera.width; ++u) {
      const auto i = static_cast<std::size_t>(v * view.camera.width + u);
      expect_same(part[i], some.has(u, v) ? whole[i] : GBufferPixel());
    }
  }
}

TEST(TracedTiles, OnePixelOfEachIsThatOfTheWholePicture) {
  const View view(wide_floor());
  const std::vector<GBufferPixel> whole = view.traced(view.all());
  const relight::TilePixels tiles = trace_tiles(view.room, view.eye, view.radiance);
  for (int y = 0; y < tiles.camera.height; ++y) {
    for (int x = 0; x < tiles.camera.width; ++x) {
      const int u = relight::TilePixels::pixel_of(x, view.camera.width),
                v = relight::TilePixels::pixel_of(y, view.camera.height);
      expect_same(tiles.at(u, v), whole[static_cast<std::size_t>(v * view.camera.width + u)]);
    }
  }
}

TEST(TracedTiles, WhatStandsBeforeTheFusedRoomIsFoundInTilesThatItCovers) {
  const ClosedScene scene = wide_floor();
  const View view(scene);
  const std::vector<GBufferPixel> whole = view.traced(view.all());
  capture::Image<float> depth_m(view.camera.width, view.camera.height, 1);
  const Eigen::AlignedBox2i hand(Eigen::Vector2i(100, 80), Eigen::Vector2i(139, 109)),
      around(hand.min() - Eigen::Vector2i(32, 32), hand.max() + Eigen::Vector2i(32, 32));
  for (int v = 0; v < depth_m.height; ++v) {
    for (int u = 0; u < depth_m.width; ++u) {
      const GBufferPixel& p = whole[static_cast<std::size_t>(v * depth_m.width + u)];
      const float fused_m = p.known ? p.depth_m * view.rays.cosine(u, v) : 0;
      depth_m.at(u, v) = hand.contains(Eigen::Vector2i(u, v)) ? 0.7f * fused_m : fused_m;
    }
  }
  const relight::CurrentDepth depth(view.rays, &depth_m, scene.voxel_m);
  TileMask tiles(depth_m.width, depth_m.height, false);
  add_moved_tiles(view.eye, depth, *view.room.field(), {{}, view.room.field(), {}}, tiles);
  int away = 0;
  for (int v = 0; v < depth_m.height; ++v) {
    for (int u = 0; u < depth_m.width; ++u) {
      const Eigen::Vector2i at(u, v);
      const bool known = whole[static_cast<std::size_t>(v * depth_m.width + u)].known;
      EXPECT_TRUE(tiles.has(u, v) || !hand.contains(at)) << at.transpose();
      away += tiles.has(u, v) && known && !around.contains(at);
    }
  }
  EXPECT_EQ(away, 0);
}

/// Pictures of a camera that moves by these steps, of which the last is asked for with its maps or without: with them
/// every pixel is traced.
relight::RelitPicture last_of_moving(ClosedScene scene, int steps, bool whole) {
  relight::RayRenderer renderer(scene.session());
  reconstruct::Scene room = scene.scene();
  relight::RelitPicture picture;
  for (int k = 0; k < steps; ++k) {
    scene.eye_m.x() += 0.02f;
    room.pose = scene.scene().pose;
    picture = renderer.relight(scene.frame(), room, scene.exhibit, rays_plan(8), whole && k + 1 == steps);
  }
  return picture;
}

TEST(TracedTiles, OfAMovingCameraGiveThePictureOfAllPixels) {
  const ClosedScene scene = wide_floor();
  const relight::RelitPicture some = last_of_moving(scene, 3, false), whole = last_of_moving(scene, 3, true);
  ASSERT_TRUE(std::ranges::any_of(some.passes, [](const auto& pass) { return pass.name == "tiles"; }));
  int changed = 0, different = 0, most = 0;
  for (std::size_t i = 0; i < some.srgb.data.size(); ++i) {
    const int off = std::abs(some.srgb.data[i] - whole.srgb.data[i]);
    changed += whole.srgb.data[i] != (*whole.camera).data[i];
    different += off > 0;
    most = std::max(most, off);
  }
  // At the border the cells' noise decides about the last code, and filters have fewer neighbours.
  EXPECT_LE(most, 1);
  EXPECT_LT(different, changed / 20);
  EXPECT_GT(changed, 1000);
}

/// The shadow of the rod is 1.4 pixels wide: narrower than a tile, and than a pixel of a reduced view.
ClosedScene thin_rod() {
  ClosedScene scene = wide_floor();
  scene.lamps = {lamp_at({0.3f, 0.1f, 0.5f}, 0.002f, 0.2f)};
  scene.exhibit.objects = {box_object({-0.004f, -0.004f, 0.01f}, {0.004f, 0.004f, 0.2f}, 0.9f)};
  return scene;
}

/// It passes between the pixels of which there is one for each tile.
TEST(TracedTiles, HoldTheShadowOfAThinRod) {
  const ClosedScene scene = thin_rod();
  const relight::RelitPicture some = last_of_moving(scene, 3, false), whole = last_of_moving(scene, 3, true);
  int changed = 0, different = 0;
  for (std::size_t i = 0; i < some.srgb.data.size(); ++i) {
    changed += whole.srgb.data[i] != (*whole.camera).data[i];
    different += std::abs(some.srgb.data[i] - whole.srgb.data[i]) > 1;
  }
  EXPECT_GT(changed, 200);
  EXPECT_EQ(different, 0);
}

TEST(LiveShadows, OfAThinRodAreFoundAtLowResolution) {
  const ClosedScene scene = thin_rod();
  const auto darkened = [&](int trace_scale) {
    relight::RayRenderer renderer(scene.session());
    const auto picture =
        renderer.relight(scene.frame(), scene.scene(), scene.exhibit, rays_plan(trace_scale), /*with_maps=*/true);
    double sum = 0;
    for (const float change : picture.maps->delta.data) sum += std::min(change, 0.0f);
    return sum;
  };
  const double all = darkened(1);
  ASSERT_LT(all, -5);
  for (const int trace_scale : {4, 8, 16}) EXPECT_NEAR(darkened(trace_scale) / all, 1, 0.5) << trace_scale;
}

/// When it has come to rest, objects that move do not let it trace anew in every frame.
TEST(TracedTiles, AreAllOnceACameraAtRestNeedsOthers) {
  ClosedScene scene = wide_floor();
  relight::RayRenderer renderer(scene.session());
  reconstruct::Scene room = scene.scene();
  const auto next = [&] { return renderer.relight(scene.frame(), room, scene.exhibit, rays_plan(8)); };
  next();
  scene.eye_m.x() += 0.1f;
  room.pose = scene.scene().pose;
  next();
  scene.exhibit.objects.front().position_m.x() -= 0.25;
  next();
  scene.exhibit.objects.front().position_m.x() += 0.01;
  const relight::RelitPicture moved = next();
  EXPECT_TRUE(std::ranges::none_of(moved.passes, [](const auto& pass) { return pass.name == "tiles"; }));
}

}  // namespace
}  // namespace lumigraft::test
