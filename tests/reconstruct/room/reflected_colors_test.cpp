// A table of coloured tiles before a wall that depth measures: what the wall shows decides whether it is a mirror.
#include "reconstruct/room/reflected_colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/reconstruct/fusion/fusion_views.h"
#include "tests/reconstruct/fusion/real_surface_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kWall_m = 0.5, kTile_m = 0.12;
const Vector3d kBrown(0.4, 0.3, 0.2), kGrey(0.35, 0.35, 0.35);

double table_and_wall(const Vector3d& p) { return std::min(p.z(), kWall_m - p.y()); }
bool on_wall(const Vector3d& p) { return kWall_m - p.y() < p.z(); }

/// One of many colours for each tile of a plane.
Vector3d tile(double x, double y) {
  std::mt19937 random(static_cast<unsigned>(1000 * std::floor(x / kTile_m) + std::floor(y / kTile_m) + 1e6));
  std::uniform_real_distribution<double> channel(0.05, 0.45);
  const double red = channel(random), green = channel(random);
  return {red, green, channel(random)};
}
Vector3d tiled_table(const Vector3d& p) { return tile(p.x(), p.y()); }

/// Radiance of a point towards a camera.
using Look = std::function<Vector3d(const Vector3d& p, const Vector3d& camera)>;

Look mirror_of(double reflectance, const Vector3d& own) {
  return [=](const Vector3d& p, const Vector3d& camera) -> Vector3d {
    if (!on_wall(p)) return tiled_table(p);
    Vector3d along = (p - camera).normalized();
    along.y() = -along.y();
    const Vector3d from = p - 1e-3 * Vector3d::UnitY();
    const auto far = test::march(table_and_wall, from, along);
    return own + reflectance * (far ? tiled_table(from + *far * along) : Vector3d(0.1, 0.1, 0.1));
  };
}

std::vector<ReflectingPlane> found(const Look& look, const std::vector<double>& azimuths_deg,
                                   const std::vector<capture::RealSurface>& named = {}) {
  const capture::CameraModel camera = test::small_camera();
  capture::Session session = test::session_with(camera);
  FusionStage stage(session, {});
  std::shared_ptr<const DistanceField> field;
  unsigned index = 0;
  for (const double azimuth : azimuths_deg) {
    const Isometry3d T = test::looking_at_tag(1.6, 60 * test::kDegree, azimuth * test::kDegree, {0, 0.3, 0.2});
    capture::FrameSet frame = test::frame_of(table_and_wall, camera, T, index, {0.5, index + 1});
    auto color = std::make_shared<capture::Frame>(*frame.color);
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
        const Vector3d along = T.linear() * *ray;
        const auto far = test::march(table_and_wall, T.translation(), along);
        const Vector3d seen = far ? look(T.translation() + *far * along, T.translation()) : Vector3d::Zero();
        for (int c = 0; c < 3; ++c)
          color->encoded.at(u, v, c) = static_cast<std::uint8_t>(
              std::lround(255 * capture::linear_to_srgb(std::min(1.0f, static_cast<float>(2 * seen[c])))));
      }
    frame.color = color;
    field = test::fuse_all(stage, frame, test::pose_at(T));
    ++index;
  }
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

// Nothing is taken for albedo or the fish-eye's view there.
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
