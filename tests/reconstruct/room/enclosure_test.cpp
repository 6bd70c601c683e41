// Enclosures of partly observed rooms of known shape.
#include "reconstruct/room/enclosure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kStep_m = 0.04f;

/// Points on the rectangle from `corner` along `u` and `v`.
void add_wall(std::vector<RoomPoint>& points, const Vector3f& corner, const Vector3f& u, const Vector3f& v) {
  const Vector3f normal = u.cross(v).normalized();
  for (float a = 0.5f * kStep_m; a < u.norm(); a += kStep_m) {
    for (float b = 0.5f * kStep_m; b < v.norm(); b += kStep_m) {
      points.push_back({corner + a * u.normalized() + b * v.normalized(), normal});
    }
  }
}

/// Floor z = 0 and back wall y = 2, as far as x = ±1; the left wall x = -1 from y = 1 on.
std::vector<RoomPoint> corner_of_room() {
  std::vector<RoomPoint> points;
  add_wall(points, {-1, 0, 0}, {2, 0, 0}, {0, 2, 0});
  add_wall(points, {-1, 2, 0}, {2, 0, 0}, {0, 0, 1});
  add_wall(points, {-1, 1, 0}, {0, 1, 0}, {0, 0, 1});
  return points;
}

Illumination light_with(const std::vector<PointLight>& lamps) {
  Illumination light;
  light.probe_position_m = {0, 0.5f, 0.05f};
  light.lights = lamps;
  return light;
}

PointLight ceiling_panel(float height_m) {
  PointLight lamp;
  lamp.distance_known = lamp.flat = true;
  lamp.position_m = {0.2f, 0.3f, height_m};
  lamp.normal = {0, 0, -1};
  return lamp;
}

const Enclosure::Side* side_towards(const Enclosure& room, const Vector3f& outward) {
  for (const Enclosure::Side& side : room.sides) {
    if (side.normal.dot(outward) < -0.99f) return &side;
  }
  return nullptr;
}

TEST(Enclosure, ObservedSidesAreFound) {
  const auto room = close_room(corner_of_room(), light_with({}), {});
  ASSERT_TRUE(room);
  ASSERT_EQ(room->sides.size(), 6U);
  for (const auto& [outward, offset_m] :
       {std::pair{Vector3f(0, 0, -1), 0.0f}, std::pair{Vector3f(0, 1, 0), 2.0f}, std::pair{Vector3f(-1, 0, 0), 1.0f}}) {
    const Enclosure::Side* side = side_towards(*room, outward);
    ASSERT_NE(side, nullptr) << outward.transpose();
    EXPECT_TRUE(side->measured);
    EXPECT_NEAR(side->offset_m, offset_m, 1e-3);
  }
}

// The camera is in the room, so the wall behind it is farther away.
TEST(Enclosure, EverythingKnownIsInside) {
  const Vector3f camera(0.3f, -1.5f, 1.2f);
  const auto room = close_room(corner_of_room(), light_with({ceiling_panel(1.9f)}), {camera});
  ASSERT_TRUE(room);
  for (const Vector3f& p : {camera, Vector3f(0.2f, 0.3f, 1.89f), Vector3f(0, 0.5f, 0.05f), room->middle_m}) {
    for (const Enclosure::Side& side : room->sides) EXPECT_GT(side.normal.dot(p) + side.offset_m, 0) << p.transpose();
  }
  const Enclosure::Side* behind_camera = side_towards(*room, {0, -1, 0});
  ASSERT_NE(behind_camera, nullptr);
  EXPECT_FALSE(behind_camera->measured);
  EXPECT_NEAR(behind_camera->offset_m, 1.5f + 0.5f * (1.5f + 0.5f), 1e-3);  // half as far again from the fish-eye
}

TEST(Enclosure, PanelThatFacesDownIsTheCeiling) {
  const auto room = close_room(corner_of_room(), light_with({ceiling_panel(2.4f)}), {});
  ASSERT_TRUE(room);
  const Enclosure::Side* ceiling = side_towards(*room, {0, 0, 1});
  ASSERT_NE(ceiling, nullptr);
  EXPECT_TRUE(ceiling->measured);
  EXPECT_NEAR(ceiling->offset_m, 2.4f, 1e-3);
}

// A desk lamp below the top of the observed walls also emits downwards.
TEST(Enclosure, PanelBelowTheWallsTopIsNotTheCeiling) {
  const auto room = close_room(corner_of_room(), light_with({ceiling_panel(0.6f)}), {});
  ASSERT_TRUE(room);
  const Enclosure::Side* ceiling = side_towards(*room, {0, 0, 1});
  ASSERT_NE(ceiling, nullptr);
  EXPECT_FALSE(ceiling->measured);
  EXPECT_GT(ceiling->offset_m, 1.0f);
}

// The top and front of a table have known surface behind them.
TEST(Enclosure, FurnitureIsNoSide) {
  std::vector<RoomPoint> points = corner_of_room();
  add_wall(points, {-0.6f, 0.2f, 0.7f}, {1.6f, 0, 0}, {0, 1.4f, 0});
  add_wall(points, {-0.6f, 0.2f, 0.1f}, {1.6f, 0, 0}, {0, 0, 0.6f});
  const auto room = close_room(points, light_with({}), {});
  ASSERT_TRUE(room);
  for (const Enclosure::Side& side : room->sides) {
    if (!side.measured) continue;
    EXPECT_GT(std::abs(side.offset_m), side.normal.z() > 0.9f ? -1e-3f : 0.9f);
    if (side.normal.z() > 0.9f) {
      EXPECT_NEAR(side.offset_m, 0, 1e-3);
    }
  }
}

TEST(Enclosure, RaysLeaveThroughTheNearestSide) {
  const auto room = close_room(corner_of_room(), light_with({}), {});
  ASSERT_TRUE(room);
  const auto exit = room->leave({0, 1, 0.5f}, Vector3f(0, 0.6f, -0.8f));
  ASSERT_TRUE(exit);
  EXPECT_NEAR(exit->distance_m, 0.5f / 0.8f, 1e-3);
  EXPECT_GT(room->sides[exit->side].normal.z(), 0.99f);
}

TEST(Enclosure, FewPointsAreNotARoom) {
  std::vector<RoomPoint> points;
  add_wall(points, {0, 0, 0}, {0.2f, 0, 0}, {0, 0.2f, 0});
  EXPECT_FALSE(close_room(points, light_with({}), {}));
  EXPECT_FALSE(close_room({}, light_with({}), {}));
}

// A sphere has no planar side.
TEST(Enclosure, SphereIsNotARoom) {
  std::vector<RoomPoint> points;
  for (int i = 0; i < 2000; ++i) {
    const float z = 1 - (static_cast<float>(i) + 0.5f) / 1000, s = std::sqrt(1 - z * z),
                phi = 2.39996323f * static_cast<float>(i);
    const Vector3f n(s * std::cos(phi), s * std::sin(phi), z);
    points.push_back({n, n});
  }
  EXPECT_FALSE(close_room(points, light_with({}), {}));
}

// A floor between two layers of voxels of a fused field.
TEST(Enclosure, PointsOfAFieldLieOnItsSurface) {
  DistanceField field;
  for (int x = 0; x < 4; ++x) {
    auto brick = std::make_shared<FieldBrick>();
    for (int i = 0; i < kBrickVoxels; ++i) {
      const auto k = static_cast<std::size_t>(i);
      brick->distance_m[k] = field.voxel_m * static_cast<float>(i / 64) - 0.021f;
      brick->weight[k] = 1;
    }
    field.bricks[{x, 0, 0}] = brick;
  }
  const std::vector<RoomPoint> points = room_points(field);
  EXPECT_GE(points.size(), 8U);
  for (const RoomPoint& p : points) {
    EXPECT_NEAR(p.position_m.z(), 0.021f, 0.1f * field.voxel_m);
    EXPECT_GT(p.normal.z(), 0.999f);
  }
}

TEST(Enclosure, TheSameRoomIsTheSamePointer) {
  DistanceField field;
  for (int x = 0; x < 16; ++x) {
    for (int y = 0; y < 16; ++y) {
      auto brick = std::make_shared<FieldBrick>();
      for (int i = 0; i < kBrickVoxels; ++i) {
        const auto k = static_cast<std::size_t>(i);
        brick->distance_m[k] = field.voxel_m * static_cast<float>(i / 64) - 0.02f;
        brick->weight[k] = 1;
      }
      field.bricks[{x, y, 0}] = brick;
    }
  }
  EnclosureStage stage;
  const auto first = stage.close(field, room_points(field), light_with({}));
  ASSERT_TRUE(first);
  EXPECT_EQ(stage.close(field, room_points(field), light_with({})), first);
  field.seen_from_m.push_back(Vector3f(0, 0, 2));
  const auto higher = stage.close(field, room_points(field), light_with({}));
  ASSERT_TRUE(higher);
  EXPECT_NE(higher, first);
  EXPECT_GT(side_towards(*higher, {0, 0, 1})->offset_m, 2);
}

// Cameras on one side of an oblique wall: their bounding box crosses it, the cameras do not.
TEST(Enclosure, ObliqueWallInsideTheCamerasBoundingBoxIsASide) {
  DistanceField field;
  const auto in_front_m = [](const Vector3f& p) { return (p.x() + p.y() - 1.5f) * std::sqrt(0.5f); };
  const float edge_m = field.voxel_m * kBrickEdge;
  for (int x = 0; x < 24; ++x) {
    for (int y = 0; y < 24; ++y) {
      if (std::abs(in_front_m({edge_m * (x + 0.5f), edge_m * (y + 0.5f), 0})) > edge_m) continue;
      for (int z = 0; z < 10; ++z) {
        auto brick = std::make_shared<FieldBrick>();
        for (int i = 0; i < kBrickVoxels; ++i) {
          const auto k = static_cast<std::size_t>(i);
          const Vector3f p = edge_m * Vector3f(x, y, z) + field.voxel_m * Vector3f(i % 8, i / 8 % 8, i / 64);
          brick->distance_m[k] = in_front_m(p);
          brick->weight[k] = 1;
        }
        field.bricks[{x, y, z}] = brick;
      }
    }
  }
  field.seen_from_m = {{0, 2, 1}, {2, 0, 1}};
  Illumination light;
  light.probe_position_m = {1.5f, 1.5f, 0.1f};
  const auto room = EnclosureStage().close(field, room_points(field), light);
  ASSERT_TRUE(room);
  const Enclosure::Side* wall = side_towards(*room, Vector3f(-1, -1, 0).normalized());
  ASSERT_NE(wall, nullptr);
  EXPECT_TRUE(wall->measured);
  EXPECT_NEAR(wall->offset_m, -1.5f * std::sqrt(0.5f), 0.01f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
