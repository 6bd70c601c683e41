#include "reconstruct/room/reflected_colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "reconstruct/room/mirror_detection.h"
#include "tests/reconstruct/fusion/real_surface_views.h"
#include "tests/reconstruct/room/mirror_wall.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3d;
using test::kTile_m;
using test::kWall_m;
using test::Look;
using test::mirror_of;
using test::on_wall;
using test::tile;
using test::tiled_table;

const Vector3d kBrown(0.4, 0.3, 0.2), kGrey(0.35, 0.35, 0.35);

std::vector<ReflectingPlane> found(const Look& look, const std::vector<double>& azimuths_deg,
                                   const std::vector<capture::RealSurface>& named = {}) {
  const auto field = test::fused(look, azimuths_deg);
  capture::Session session;
  session.real_surfaces = named;
  return find_reflecting_planes(room_points(*field), *field, MetalMask(session));
}

const std::vector<double> kFromTheFront = {-90}, kFromThreeSides = {-110, -90, -70};

TEST(ReflectedColors, AMirrorWallIsFound) {
  for (const auto& views : {kFromTheFront, kFromThreeSides}) {
    const auto planes = found(mirror_of(0.8, Vector3d::Zero()), views);
    ASSERT_EQ(planes.size(), 1u) << views.size();
    const ReflectingPlane& wall = planes[0];
    std::printf("mirror of 0.8, %zu views: luminance %.2f (correlation %.2f), hue %.2f (%.2f), %d points\n",
                views.size(), wall.luminance.slope, wall.luminance.correlation, wall.hue.slope, wall.hue.correlation,
                wall.points);
    EXPECT_LT((wall.plane.normal + Eigen::Vector3f::UnitY()).norm(), 0.05f);
    EXPECT_NEAR(wall.middle_m.y(), kWall_m, 0.02);
    EXPECT_NEAR(wall.luminance.slope, 0.8, views.size() == 1 ? 0.15 : 0.4);
  }
}

TEST(ReflectedColors, AMirrorThatIsNamedIsNotReported) {
  auto mirror = test::real_surface("wall", test::box_faces({0, kWall_m + 0.01, 0.5}, {2, 0.01, 0.6}));
  mirror.metallic = 1;
  EXPECT_TRUE(found(mirror_of(0.8, Vector3d::Zero()), kFromTheFront, {mirror}).empty());
}

TEST(ReflectedColors, AWarningNamesThePlace) {
  const auto field = test::fused(mirror_of(0.8, Vector3d::Zero()), kFromTheFront);
  const std::vector<RoomPoint> points = room_points(*field);
  const auto warnings = mirror_warnings(points, *field, find_reflecting_planes(points, *field, MetalMask({})));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find(" 0.50, "), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("[[real_surface]]"), std::string::npos);
}

TEST(ReflectedColors, AMirrorThatWasFoundIsMetal) {
  MetalMask metal{capture::Session()};
  EXPECT_FALSE(metal.contains({0.3f, 0.5f, 0.2f}));
  metal.set_mirrors({{-Eigen::Vector3f::UnitY(), 0.5f}});
  EXPECT_TRUE(metal.contains({0.3f, 0.49f, 0.2f}));
  EXPECT_FALSE(metal.contains({0.3f, 0.4f, 0.2f}));
  metal.set_mirrors({});
  EXPECT_FALSE(metal.contains({0.3f, 0.5f, 0.2f}));
}

TEST(ReflectedColors, VarnishOnAWallIsNoMirror) {
  EXPECT_TRUE(found(mirror_of(0.1, {0.2, 0.2, 0.2}), kFromTheFront).empty());
}

TEST(ReflectedColors, AWallOfOtherTilesIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d&) {
    return on_wall(p) ? tile(p.x() + 7 * kTile_m, p.z()) : tiled_table(p);
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

// Bars of shadow over table and wall are symmetric about the edge between them.
TEST(ReflectedColors, AShadowThatContinuesOnTheWallIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d&) -> Vector3d {
    const double light = std::sin(2 * M_PI * p.x() / 0.3) > 0 ? 1 : 0.3;
    return light * (on_wall(p) ? kGrey : kBrown);
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

// As under shadows that are exactly symmetric about the edge between table and wall.
TEST(ReflectedColors, LuminanceAloneIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d& camera) -> Vector3d {
    const Vector3d reflected = mirror_of(0.8, Vector3d::Zero())(p, camera);
    return on_wall(p) ? Vector3d::Constant(reflected.mean()) : reflected;
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

TEST(ReflectedColors, HueAloneIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d& camera) -> Vector3d {
    const Vector3d reflected = mirror_of(0.8, Vector3d::Zero())(p, camera);
    return on_wall(p) ? Vector3d(reflected.array() - reflected.mean() + 0.25) : reflected;
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

TEST(ReflectedColors, StrongPaintUnderVarnishIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d& camera) -> Vector3d {
    if (!on_wall(p)) return tiled_table(p);
    return 0.8 * tile(p.x() + 7 * kTile_m, p.z()) + mirror_of(0.46, Vector3d::Zero())(p, camera);
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

// Light that is bluer towards the edge between table and wall.
TEST(ReflectedColors, AGradientOverTableAndWallIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d&) -> Vector3d {
    const double away = on_wall(p) ? p.z() : kWall_m - p.y();
    return {0.1 + 0.4 * away, 0.15 + 0.8 * away * away, 0.35 - 0.15 * away};
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

// The tiles colour the light on the wall above them.
TEST(ReflectedColors, ColourBleedingIsNoMirror) {
  const Look look = [](const Vector3d& p, const Vector3d&) -> Vector3d {
    if (!on_wall(p)) return tiled_table(p);
    return 0.8 * kGrey + 0.1 * tile(p.x(), kWall_m - 0.5 * p.z());
  };
  EXPECT_TRUE(found(look, kFromTheFront).empty());
}

}  // namespace
}  // namespace lumigraft::reconstruct
