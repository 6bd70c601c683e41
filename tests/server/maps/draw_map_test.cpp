#include "server/maps/draw_map.h"

#include <gtest/gtest.h>

#include "capture/camera/srgb.h"
#include "server/maps/parameters.h"

namespace lumigraft::server {
namespace {

using Picture = capture::Image<std::uint8_t>;

constexpr int kWidth = 64, kHeight = 48;
constexpr float kPlane_m = 1.5f;  ///< distance of the plane z = 0 from the camera, which looks down the tag's z axis
const Eigen::Vector3f kAlbedo(0.2f, 0.5f, 0.05f);

/// The plane z = 0 for x < 0.1 m; its albedo is known for x < 0.
void add_plane(reconstruct::Scene& scene) {
  auto field = std::make_shared<reconstruct::DistanceField>();
  auto albedo = std::make_shared<reconstruct::AlbedoField>();
  field->version = albedo->version = 1;
  for (int a = -16; a < 2; ++a) {
    for (int b = -16; b < 16; ++b) {
      for (int c = -1; c < 1; ++c) {
        auto brick = std::make_shared<reconstruct::FieldBrick>();
        auto color = std::make_shared<reconstruct::AlbedoBrick>();
        for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
          const auto at = static_cast<std::size_t>(i);
          const float z_m = field->voxel_m * static_cast<float>(8 * c + i / 64);
          brick->distance_m[at] = std::clamp(z_m, -field->truncation_m, field->truncation_m);
          brick->weight[at] = 1;
          color->albedo[at] = kAlbedo;
          color->sigma[at] = 0.1f;
        }
        field->bricks[{a, b, c}] = brick;
        if (a < 0) albedo->bricks[{a, b, c}] = color;
      }
    }
  }
  scene.field = field;
  scene.albedo = albedo;
}

class DrawMap : public testing::Test {
 protected:
  DrawMap() {
    source_.camera = Picture(kWidth, kHeight, 3, 100);
    auto shown = std::make_shared<Picture>(kWidth, kHeight, 3, 100);
    for (int u = 0; u < kWidth / 2; ++u) {
      for (std::size_t c = 0; c < 3; ++c) shown->data[3 * static_cast<std::size_t>(u) + c] = 60;  // the first row
    }
    source_.shown = shown;
    source_.lens = {.width = kWidth, .height = kHeight, .fx = 50, .fy = 50, .cx = 31.5, .cy = 23.5};
  }
  void see_plane() {
    reconstruct::Pose pose;
    pose.T_tag_camera.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    pose.T_tag_camera.translation().z() = kPlane_m;
    source_.scene.pose = pose;
    add_plane(source_.scene);
  }
  /// Black where there is no map.
  std::array<int, 3> pixel(MapKind kind, int u, int v) {
    const auto map = draw_map(kind, source_, surface_);
    if (!map) return {};
    const std::size_t i = 3 * static_cast<std::size_t>(v * map->width + u);
    return {map->data[i], map->data[i + 1], map->data[i + 2]};
  }
  static std::array<int, 3> grey(int value) { return {value, value, value}; }

  MapSource source_;
  SeenSurface surface_;
};

TEST_F(DrawMap, ComparesThePictures) {
  EXPECT_EQ(pixel(MapKind::change, 0, 0), grey(128 - 2 * 40));
  EXPECT_EQ(pixel(MapKind::change, 0, 1), grey(128));
  const auto& linear = capture::srgb_table().linear;
  EXPECT_EQ(pixel(MapKind::shadow, 0, 0), grey(capture::srgb_table().code(linear[60] / linear[100])));
  EXPECT_EQ(pixel(MapKind::shadow, 0, 1), grey(255));
  const auto pair = draw_map(MapKind::before_after, source_, surface_);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->width, 2 * kWidth);
  EXPECT_EQ(pixel(MapKind::before_after, 0, 0), grey(100));
  EXPECT_EQ(pixel(MapKind::before_after, kWidth, 0), grey(60));
  EXPECT_EQ(pixel(MapKind::before_after, kWidth, 1), grey(100));
}

TEST_F(DrawMap, WhatIsNotKnownIsNoMap) {
  for (const MapKind kind : {MapKind::depth, MapKind::surface, MapKind::albedo, MapKind::lamps})
    EXPECT_FALSE(draw_map(kind, source_, surface_)) << name_of(kind);
  see_plane();
  source_.scene.albedo = nullptr;
  EXPECT_TRUE(draw_map(MapKind::depth, source_, surface_));
  EXPECT_FALSE(draw_map(MapKind::albedo, source_, surface_));
  EXPECT_FALSE(draw_map(MapKind::lamps, source_, surface_));
}

TEST_F(DrawMap, ShowsTheSurface) {
  see_plane();
  EXPECT_EQ(pixel(MapKind::surface, 20, 20), (std::array{128, 128, 255})) << "it faces up";
  std::array<int, 3> color{};
  for (int c = 0; c < 3; ++c) color[static_cast<std::size_t>(c)] = capture::srgb_table().code(kAlbedo[c]);
  EXPECT_EQ(pixel(MapKind::albedo, 20, 20), color);
  EXPECT_EQ(pixel(MapKind::albedo, 33, 20), grey(48)) << "a surface whose albedo is not known";
  EXPECT_EQ(pixel(MapKind::albedo, kWidth - 1, 20), grey(0)) << "no surface is known";
  EXPECT_EQ(pixel(MapKind::depth, kWidth - 1, 20), grey(0));
  EXPECT_NE(pixel(MapKind::depth, 20, 20), grey(0));
  EXPECT_EQ(pixel(MapKind::depth, 2, 2), pixel(MapKind::depth, 20, 20)) << "depth along the axis, not the ray";
  const std::optional<SeenSurface::Pixel>& hit = surface_.at(10, 40);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->depth_m, kPlane_m, 1e-3);
  EXPECT_NEAR(hit->position_m.x(), (10.5 - 31.5) / 50 * kPlane_m, 1e-3) << "the ray between two pixels";
}

TEST_F(DrawMap, NearIsRedAndFarIsBlue) {
  see_plane();
  source_.scene.pose->T_tag_camera.translation().z() = 0.35;
  const std::array<int, 3> near = pixel(MapKind::depth, 20, 20);
  source_.scene.pose->T_tag_camera.translation().z() = 7;
  const std::array<int, 3> far = pixel(MapKind::depth, 30, 22);
  EXPECT_GT(near[0], near[2] + 50);
  EXPECT_GT(far[2], far[0] + 50);
}

TEST_F(DrawMap, MarksLampsWhereTheyAre) {
  see_plane();
  auto light = std::make_shared<reconstruct::Illumination>();
  reconstruct::PointLight lamp;
  lamp.irradiance = {1, 0, 0};
  lamp.distance_known = true;
  lamp.position_m = {-0.3f, 0, 0.5f};  // 1 m before the camera
  light->lights = {lamp};
  source_.scene.illumination = light;
  const auto middle = pixel(MapKind::lamps, 16, 23);  // 31.5 - 50 * 0.3
  EXPECT_GT(middle[0], 200);
  EXPECT_LT(middle[1], 60);
  EXPECT_EQ(pixel(MapKind::lamps, 60, 2), grey(35)) << "the camera's picture, darker";
}

}  // namespace
}  // namespace lumigraft::server
